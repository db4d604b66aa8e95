#include "fsw/base/time.h"

#include <gtest/gtest.h>

#include <limits>
#include <type_traits>

#include "test/support/property.h"

namespace plumb {
namespace {

constexpr std::int64_t kMax = std::numeric_limits<std::int64_t>::max();
constexpr std::int64_t kMin = std::numeric_limits<std::int64_t>::min();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(Duration, UnitsAgree) {
  EXPECT_EQ(Duration().ns(), 0);
  EXPECT_EQ(Duration::from_us(1), Duration::from_ns(1'000));
  EXPECT_EQ(Duration::from_ms(1), Duration::from_us(1'000));
  EXPECT_EQ(Duration::from_seconds(1.0), Duration::from_ms(1'000));
  EXPECT_DOUBLE_EQ(Duration::from_ms(250).seconds(), 0.25);
}

TEST(Duration, FromSecondsRoundsToTheNearestNanosecond) {
  EXPECT_EQ(Duration::from_seconds(1.4e-9).ns(), 1);
  EXPECT_EQ(Duration::from_seconds(1.6e-9).ns(), 2);
  EXPECT_EQ(Duration::from_seconds(-1.4e-9).ns(), -1);
  EXPECT_EQ(Duration::from_seconds(-1.6e-9).ns(), -2);
  EXPECT_EQ(Duration::from_seconds(-0.0).ns(), 0);
}

TEST(Duration, FromSecondsIsDefinedForEveryDouble) {
  EXPECT_EQ(Duration::from_seconds(std::numeric_limits<double>::quiet_NaN()).ns(), 0);
  EXPECT_EQ(Duration::from_seconds(kInfinity), Duration::max());
  EXPECT_EQ(Duration::from_seconds(-kInfinity), Duration::min());
  EXPECT_EQ(Duration::from_seconds(1e300), Duration::max());
  EXPECT_EQ(Duration::from_seconds(-1e300), Duration::min());
  EXPECT_EQ(Duration::from_seconds(9.2e9), Duration::max());
  EXPECT_EQ(Duration::from_seconds(-9.2e9), Duration::min());
  EXPECT_LT(Duration::from_seconds(9.19e9), Duration::max());
  EXPECT_GT(Duration::from_seconds(-9.19e9), Duration::min());
  EXPECT_EQ(Duration::from_seconds(std::numeric_limits<double>::denorm_min()).ns(), 0);
}

TEST(Duration, UnitsSaturate) {
  EXPECT_EQ(Duration::from_us(kMax), Duration::max());
  EXPECT_EQ(Duration::from_us(kMin), Duration::min());
  EXPECT_EQ(Duration::from_ms(kMax / 1'000'000 + 1), Duration::max());
  EXPECT_EQ(Duration::from_ms(kMin / 1'000'000 - 1), Duration::min());
  EXPECT_EQ(Duration::from_ms(kMax / 1'000'000).ns(), kMax / 1'000'000 * 1'000'000);
}

TEST(Duration, AdditionSaturates) {
  const Duration one = Duration::from_ns(1);
  EXPECT_EQ(Duration::max() + one, Duration::max());
  EXPECT_EQ(Duration::min() + -one, Duration::min());
  EXPECT_EQ(Duration::max() + Duration::max(), Duration::max());
  EXPECT_EQ(Duration::min() + Duration::min(), Duration::min());
  EXPECT_EQ((Duration::max() + Duration::min()).ns(), -1);
}

TEST(Duration, SubtractionSaturates) {
  const Duration one = Duration::from_ns(1);
  EXPECT_EQ(Duration::min() - one, Duration::min());
  EXPECT_EQ(Duration::max() - -one, Duration::max());
  EXPECT_EQ(Duration::max() - Duration::min(), Duration::max());
  EXPECT_EQ(Duration::min() - Duration::max(), Duration::min());
  EXPECT_EQ(Duration::max() - Duration::max(), Duration());
}

TEST(Duration, NegationSaturates) {
  EXPECT_EQ(-Duration::from_ns(5), Duration::from_ns(-5));
  EXPECT_EQ((-Duration::max()).ns(), kMin + 1);
  EXPECT_EQ(-Duration::min(), Duration::max());
}

TEST(Duration, MultiplicationSaturates) {
  EXPECT_EQ(Duration::from_ms(2) * 3, Duration::from_ms(6));
  EXPECT_EQ(Duration::max() * 2, Duration::max());
  EXPECT_EQ(Duration::max() * -2, Duration::min());
  EXPECT_EQ(Duration::min() * 2, Duration::min());
  EXPECT_EQ(Duration::min() * -1, Duration::max());
  EXPECT_EQ(Duration::max() * 0, Duration());
}

TEST(Time, StartsAtNever) {
  EXPECT_EQ(Time(), Time::never());
  EXPECT_LT(Time::never(), Time::from_ns(kMin + 1));
  EXPECT_GT(Time::max(), Time::from_ns(kMax - 1));
}

TEST(Time, FromSecondsFollowsDuration) {
  EXPECT_EQ(Time::from_seconds(1.5).ns(), 1'500'000'000);
  EXPECT_EQ(Time::from_seconds(kInfinity), Time::max());
  EXPECT_EQ(Time::from_seconds(-kInfinity), Time::never());
  EXPECT_EQ(Time::from_seconds(std::numeric_limits<double>::quiet_NaN()).ns(), 0);
  EXPECT_DOUBLE_EQ(Time::from_ns(2'500'000'000).seconds(), 2.5);
}

TEST(Time, EveryOperatorSaturates) {
  const Duration one = Duration::from_ns(1);
  EXPECT_EQ(Time::max() + one, Time::max());
  EXPECT_EQ(Time::never() - one, Time::never());
  EXPECT_EQ(Time::never() + -one, Time::never());
  EXPECT_EQ(Time::max() - -one, Time::max());
  EXPECT_EQ(Time::max() - Time::never(), Duration::max());
  EXPECT_EQ(Time::never() - Time::max(), Duration::min());
  // "Never" is long before any instant of a flight, so an age measured from it is beyond every limit.
  EXPECT_EQ(Time::from_seconds(10.0) - Time::never(), Duration::max());
}

TEST(Time, DividingUndoesMultiplyingAndEndsTowardsZero) {
  test::for_all(1000, [](test::Generator& g) {
    const Duration a = Duration::from_ns(g.integer(-1'000'000'000, 1'000'000'000));
    const std::int64_t k = g.integer(1, 1000);
    EXPECT_EQ(a * k / k, a);
    EXPECT_EQ((a * k + Duration::from_ns(a < Duration() ? 1 - k : k - 1)) / k, a);
  });
}

TEST(Time, OrderIsThatOfTheNanoseconds) {
  test::for_all(1000, [](test::Generator& g) {
    const auto a = static_cast<std::int64_t>(g.bits());
    const auto b = static_cast<std::int64_t>(g.bits());
    EXPECT_EQ(Time::from_ns(a) < Time::from_ns(b), a < b);
    EXPECT_EQ(Time::from_ns(a) == Time::from_ns(b), a == b);
    // The saturated difference keeps the sign: a late stamp can not look early.
    EXPECT_EQ(Time::from_ns(a) - Time::from_ns(b) < Duration(), a < b);
  });
}

TEST(Time, AddingADifferenceGoesBack) {
  test::for_all(1000, [](test::Generator& g) {
    const Time a = Time::from_ns(g.integer(-1'000'000'000'000'000'000, 1'000'000'000'000'000'000));
    const Time b = Time::from_ns(g.integer(-1'000'000'000'000'000'000, 1'000'000'000'000'000'000));
    EXPECT_EQ(b + (a - b), a);
    EXPECT_EQ(a - (a - b), b);
  });
}

template <typename A, typename B>
concept Addable = requires(A a, B b) { a + b; };

TEST(Time, DoesNotMixWithBareNumbersOrOtherInstants) {
  static_assert(!std::is_convertible_v<std::int64_t, Time>);
  static_assert(!std::is_convertible_v<std::int64_t, Duration>);
  static_assert(!std::is_convertible_v<Time, Duration>);
  static_assert(!std::is_convertible_v<Duration, Time>);
  static_assert(!Addable<Time, Time>);
  static_assert(!Addable<Time, std::int64_t>);
  static_assert(Addable<Time, Duration>);
}

}  // namespace
}  // namespace plumb
