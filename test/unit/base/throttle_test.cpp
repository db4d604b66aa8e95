#include "fsw/base/throttle.h"

#include <gtest/gtest.h>

namespace plumb {
namespace {

TEST(Throttle, SaysHowManyItKeptBack) {
  Throttle throttle(1, Duration::from_ms(1000));
  const auto at = [](std::int64_t ms) { return Time::from_ns(ms * 1'000'000); };
  EXPECT_TRUE(throttle.admit(at(0)));
  EXPECT_FALSE(throttle.admit(at(10)));
  EXPECT_FALSE(throttle.admit(at(999)));
  EXPECT_TRUE(throttle.admit(at(1001)));
  EXPECT_EQ(throttle.suppressed(), 2U);
  EXPECT_FALSE(throttle.admit(at(1002)));
  EXPECT_EQ(throttle.suppressed(), 1U) << "those that were told of are not told again";
}

}  // namespace
}  // namespace plumb
