#include "fsw/app/parameter_change.h"

#include <cmath>

namespace plumb {
namespace {

constexpr std::size_t kNumber = 0;
constexpr std::size_t kTable = 1;
constexpr std::size_t kValue = 2;
constexpr std::size_t kUnused = 3;

std::optional<std::size_t> number_in(const Command& command) {
  const double number = command.arguments[kNumber];
  const auto rows = static_cast<double>(parameter_table().rows().size());
  if (!(number >= 0.0 && number < rows) || number != std::floor(number)) return std::nullopt;
  return static_cast<std::size_t>(number);
}

}  // namespace

bool is_of_this_table(const Command& command) {
  return command.arguments[kTable] == static_cast<double>(parameter_table_crc());
}

CommandVerdict judge_set(const Command& command, Parameters& staged) {
  if (command.arguments[kUnused] != 0.0) return CommandVerdict::kArgument;
  if (!is_of_this_table(command)) return CommandVerdict::kOtherTable;
  const std::optional<std::size_t> number = number_in(command);
  if (!number) return CommandVerdict::kArgument;
  const ParamRow<Parameters>& row = parameter_table().rows()[*number];
  if (row.change == ParamChange::kNever) return CommandVerdict::kFixed;
  const double value = command.arguments[kValue];
  if (!ParamTable<Parameters>::accepts(row, value)) return CommandVerdict::kOutOfRange;
  const double before = row.get(staged);
  row.set(staged, value);
  if (conflicts_in(staged).empty()) return CommandVerdict::kAccepted;
  row.set(staged, before);
  return CommandVerdict::kConflict;
}

std::optional<ParameterChange> carry_out(const Command& command, ParameterStore& store) {
  if (!command.is(CommandId::kSetParameter) || !is_of_this_table(command)) return std::nullopt;
  const std::optional<std::size_t> number = number_in(command);
  if (!number) return std::nullopt;
  const ParamRow<Parameters>& row = parameter_table().rows()[*number];
  const double value = command.arguments[kValue];
  if (!ParamTable<Parameters>::accepts(row, value)) return std::nullopt;
  const double before = row.get(store.active());
  store.set(row, value);
  return ParameterChange{.number = *number, .before = before, .after = row.get(store.active())};
}

}  // namespace plumb
