#include "fsw/app/parameter_change.h"

#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "test/support/property.h"

namespace plumb {
namespace {

using Row = ParamRow<Parameters>;

Command set(std::size_t number, double value) {
  return {.id = static_cast<std::uint16_t>(CommandId::kSetParameter),
          .arguments = {static_cast<double>(number), static_cast<double>(parameter_table_crc()), value, 0.0}};
}

std::size_t number_of(std::string_view name) {
  return static_cast<std::size_t>(parameter_table().find(name) - parameter_table().rows().data());
}

bool equal(const Parameters& a, const Parameters& b) {
  for (const Row& row : parameter_table().rows()) {
    if (row.get(a) != row.get(b)) return false;
  }
  return true;
}

/// A value that may be in the row's range or not, a fraction or not.
double any_value(const Row& row, test::Generator& g) {
  const double span = row.max - row.min;
  const double value = g.uniform(row.min - 0.3 * span, row.max + 0.3 * span);
  switch (g.integer(0, 5)) {
    case 0: return row.min;
    case 1: return row.max;
    case 2: return std::round(value);
    case 3: return g.integer(0, 9) == 0 ? std::numeric_limits<double>::quiet_NaN() : value;
    default: return value;
  }
}

// Whatever is sent: what is accepted is in the staged copy, may change, fits its row and all other values; what is
// refused has changed nothing. Carried out in the same order, what is in force becomes the same.
TEST(ParameterChangeLaws, WhatIsAcceptedFitsAndWhatIsRefusedChangesNothing) {
  test::for_all(60, [](test::Generator& g) {
    const auto rows = parameter_table().rows();
    Parameters staged;
    ParameterStore store(parameter_table(), staged);
    int accepted = 0;
    for (int i = 0; i < 300; ++i) {
      const auto number = static_cast<std::size_t>(g.integer(0, static_cast<std::int64_t>(rows.size()) - 1));
      const Row& row = rows[number];
      Command command = set(number, any_value(row, g));
      const Parameters before = staged;
      command.verdict = judge_set(command, staged);
      const auto change = carry_out(command, store);
      ASSERT_EQ(change.has_value(), command.verdict == CommandVerdict::kAccepted);
      ASSERT_TRUE(equal(store.active(), staged));
      if (!change) {
        ASSERT_TRUE(equal(staged, before)) << row.name;
        continue;
      }
      ++accepted;
      ASSERT_NE(row.change, ParamChange::kNever);
      ASSERT_TRUE(ParamTable<Parameters>::accepts(row, command.arguments[2]));
      ASSERT_TRUE(conflicts_in(staged).empty());
      ASSERT_EQ(change->number, number);
      ASSERT_EQ(change->before, row.get(before));
      ASSERT_EQ(change->after, command.arguments[2]);
    }
    EXPECT_GT(accepted, 20);
    EXPECT_EQ(store.check(), ParamDamage::kNone);
  });
}

TEST(ParameterChange, EachReasonToRefuseHasItsVerdict) {
  Parameters staged;
  const auto verdict = [&staged](const Command& command) { return judge_set(command, staged); };
  const std::size_t gate = number_of("range.gate_sigma");
  EXPECT_EQ(verdict(set(gate, 3.0)), CommandVerdict::kAccepted);
  EXPECT_EQ(staged.estimator.range.gate_sigma, 3.0);
  EXPECT_EQ(verdict(set(gate, 1000.0)), CommandVerdict::kOutOfRange);
  EXPECT_EQ(verdict(set(gate, std::numeric_limits<double>::quiet_NaN())), CommandVerdict::kOutOfRange);
  EXPECT_EQ(verdict(set(number_of("vision.max_rejections"), 2.5)), CommandVerdict::kOutOfRange);
  EXPECT_EQ(verdict(set(number_of("range.min_range"), 50.0)), CommandVerdict::kConflict);
  EXPECT_EQ(verdict(set(number_of("imu.gravity"), 9.81)), CommandVerdict::kFixed);
  EXPECT_EQ(verdict(set(parameter_table().rows().size(), 1.0)), CommandVerdict::kArgument);
  for (const double number : {-1.0, 0.5, 1e300, std::numeric_limits<double>::quiet_NaN()}) {
    Command command = set(0, 1e-3);
    command.arguments[0] = number;
    EXPECT_EQ(verdict(command), CommandVerdict::kArgument);
    command.verdict = CommandVerdict::kAccepted;  // as a log that is not ours might say
    ParameterStore store(parameter_table(), staged);
    EXPECT_FALSE(carry_out(command, store));
  }
  Command command = set(gate, 4.0);
  command.arguments[1] += 1.0;
  EXPECT_EQ(verdict(command), CommandVerdict::kOtherTable);
  command = set(gate, 4.0);
  command.arguments[3] = 1.0;
  EXPECT_EQ(verdict(command), CommandVerdict::kArgument);
  EXPECT_EQ(staged.estimator.range.gate_sigma, 3.0);
}

TEST(ParameterChange, OtherCommandsSetNothing) {
  ParameterStore store(parameter_table(), {});
  Command command = set(number_of("range.gate_sigma"), 3.0);
  command.verdict = CommandVerdict::kRepeated;
  EXPECT_FALSE(carry_out(command, store));
  command.verdict = CommandVerdict::kAccepted;
  command.id = static_cast<std::uint16_t>(CommandId::kReset);
  EXPECT_FALSE(carry_out(command, store));
  EXPECT_TRUE(equal(store.active(), {}));
}

}  // namespace
}  // namespace plumb
