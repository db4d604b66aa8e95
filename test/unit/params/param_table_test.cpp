#include "fsw/params/param_table.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

namespace plumb {
namespace {

struct Inner {
  double gain = 2.0;
  int count = 3;
};
struct Options {
  Inner inner;
  bool enabled = true;
};

constexpr std::array kRows{
    param<Options, &Options::inner, &Inner::gain>("inner.gain", "m", 0.5, 10.0, "a real"),
    param<Options, &Options::inner, &Inner::count>("inner.count", "1", 0, 5, "a whole number"),
    param<Options, &Options::enabled>("enabled", "1", 0, 1, "a flag"),
};
constexpr ParamTable<Options> kTable{kRows};

TEST(ParamTable, TakesDefaultAndKindFromTheMember) {
  EXPECT_EQ(kTable.find("inner.gain")->default_value, 2.0);
  EXPECT_EQ(kTable.find("inner.gain")->kind, ParamKind::kReal);
  EXPECT_EQ(kTable.find("inner.count")->default_value, 3.0);
  EXPECT_EQ(kTable.find("inner.count")->kind, ParamKind::kInteger);
  EXPECT_EQ(kTable.find("enabled")->default_value, 1.0);
  EXPECT_EQ(kTable.find("enabled")->kind, ParamKind::kBoolean);
  EXPECT_EQ(kTable.find("enable"), nullptr);
}

TEST(ParamTable, WritesTheNamedMemberAndNoOther) {
  Options options;
  EXPECT_EQ(kTable.set(options, "inner.gain", 0.5).status, Status::kOk);
  EXPECT_EQ(kTable.set(options, "inner.count", 5.0).status, Status::kOk);
  EXPECT_EQ(options.inner.gain, 0.5);
  EXPECT_EQ(options.inner.count, 5);
  EXPECT_TRUE(options.enabled);
  EXPECT_EQ(kTable.set(options, "enabled", 0.0).status, Status::kOk);
  EXPECT_FALSE(options.enabled);
}

TEST(ParamTable, RefusesBadValuesWithTheRowAndKeepsTheOldOnes) {
  struct Case {
    const char* name;
    double value;
  };
  const double infinity = std::numeric_limits<double>::infinity();
  const Case cases[] = {{"inner.gain", 0.49999},  {"inner.gain", 10.00001}, {"inner.gain", std::nan("")},
                        {"inner.gain", infinity}, {"inner.count", 2.5},     {"inner.count", -1.0},
                        {"inner.count", 6.0},     {"enabled", 0.5},         {"enabled", 2.0}};
  for (const Case& c : cases) {
    SCOPED_TRACE(std::string(c.name) + " = " + std::to_string(c.value));
    Options options;
    const ParamSetResult<Options> result = kTable.set(options, c.name, c.value);
    EXPECT_EQ(result.status, Status::kInvalidValue);
    ASSERT_NE(result.row, nullptr);
    EXPECT_EQ(result.row->name, c.name);
    EXPECT_EQ(options.inner.gain, 2.0);
    EXPECT_EQ(options.inner.count, 3);
    EXPECT_TRUE(options.enabled);
  }
}

TEST(ParamTable, ToldAnUnknownNameGivesNoRow) {
  Options options;
  const ParamSetResult<Options> result = kTable.set(options, "inner.gian", 1.0);
  EXPECT_EQ(result.status, Status::kInvalidValue);
  EXPECT_EQ(result.row, nullptr);
}

TEST(ParamTable, FindsDoubleNames) {
  EXPECT_TRUE(param_names_unique<Options>(kRows));
  const std::array twice{kRows[0], kRows[1], kRows[0]};
  EXPECT_FALSE(param_names_unique<Options>(twice));
}

}  // namespace
}  // namespace plumb
