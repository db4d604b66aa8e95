#include "fsw/base/status.h"

#include <gtest/gtest.h>

#include <set>
#include <string>

namespace plumb {
namespace {

struct Reading {
  int value = 0;
};

Result<Reading> read(bool works) {
  if (!works) return Status::kStale;
  return Reading{42};
}

TEST(Status, OnlyOkIsOk) {
  EXPECT_TRUE(ok(Status::kOk));
  for (int i = 1; i <= static_cast<int>(Status::kNumericalFault); ++i) EXPECT_FALSE(ok(static_cast<Status>(i)));
}

TEST(Status, EveryValueHasItsOwnName) {
  std::set<std::string> names;
  const int count = static_cast<int>(Status::kNumericalFault) + 1;
  for (int i = 0; i < count; ++i) names.insert(to_string(static_cast<Status>(i)));
  EXPECT_EQ(names.size(), static_cast<std::size_t>(count));
  EXPECT_FALSE(names.contains("unknown"));
  EXPECT_STREQ(to_string(static_cast<Status>(255)), "unknown");
}

TEST(Result, CarriesAValue) {
  const Result<Reading> result = read(true);
  ASSERT_TRUE(result.has_value());
  EXPECT_TRUE(static_cast<bool>(result));
  EXPECT_EQ(result.status(), Status::kOk);
  EXPECT_EQ(result.value().value, 42);
  EXPECT_EQ((*result).value, 42);
  EXPECT_EQ(result->value, 42);
}

TEST(Result, CarriesTheReasonThereIsNone) {
  const Result<Reading> result = read(false);
  EXPECT_FALSE(result.has_value());
  EXPECT_FALSE(static_cast<bool>(result));
  EXPECT_EQ(result.status(), Status::kStale);
}

TEST(Result, WorksAtCompileTime) {
  constexpr Result<int> kValue(7);
  static_assert(kValue.has_value() && *kValue == 7);
  constexpr Result<int> kNone(Status::kFull);
  static_assert(!kNone && kNone.status() == Status::kFull);
}

TEST(ResultDeathTest, ReadingAMissingValueIsABug) { EXPECT_DEATH((void)read(false).value(), ""); }

TEST(ResultDeathTest, OkWithoutAValueIsABug) { EXPECT_DEATH((void)Result<int>(Status::kOk), ""); }

}  // namespace
}  // namespace plumb
