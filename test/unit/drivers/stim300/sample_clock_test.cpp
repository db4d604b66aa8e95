#include "drivers/stim300/sample_clock.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "test/support/property.h"

namespace plumb::stim300 {
namespace {

constexpr Time kStart = Time::from_ns(5'000'000'000);
constexpr std::int64_t kPeriod_ns = 500'000;

// A unit whose crystal is `drift` fast, and a host that sees each datagram late by some time.
class Line {
 public:
  explicit Line(double drift = 0.0) : drift_(drift) {}
  Time true_time(std::int64_t tick) const {
    return kStart + Duration::from_ns(std::llround(static_cast<double>(tick * kPeriod_ns) * (1.0 - drift_)));
  }
  SampleClock::Tick arrive(std::int64_t tick, Duration late) {
    const Time t = true_time(tick) + late;
    const SampleClock::Tick result = clock.update(static_cast<std::uint8_t>(tick), t, t_silent_);
    t_silent_ = t;
    return result;
  }
  SampleClock clock;

 private:
  double drift_;
  Time t_silent_ = Time::never();
};

// The law: a stamp is never later than the datagram was seen, and off by no more than the least delay of late, whatever
// the others had.
TEST(Stim300SampleClock, IsAsGoodAsTheMostPromptDatagrams) {
  test::for_all(50, [](test::Generator& g) {
    Line line(g.uniform(-100e-6, 100e-6));
    const std::int64_t step = std::int64_t{1} << g.integer(0, 4);
    double worst_us = 0.0;
    for (std::int64_t i = 0; i < 2000; ++i) {
      const std::int64_t tick = i * step;
      const bool prompt = i % 10 == 0;  // one in ten
      const Duration late = Duration::from_us(prompt ? g.integer(0, 20) : g.integer(0, 4500));
      const SampleClock::Tick result = line.arrive(tick, late);
      ASSERT_LE(result.t, line.true_time(tick) + late);
      ASSERT_EQ(result.elapsed, i > 0 ? step : 0);
      worst_us = std::max(worst_us, std::abs((result.t - line.true_time(tick)).seconds() * 1e6));
    }
    // 20 us, and what the drifts make in the 80 ms that ten datagrams take at most.
    EXPECT_LT(worst_us, 20.0 + 80e3 * 600e-6);
  });
}

TEST(Stim300SampleClock, CountsLostDatagramsAcrossTheCountersTurn) {
  Line line;
  EXPECT_TRUE(line.arrive(0, {}).first);
  EXPECT_EQ(line.arrive(8, {}).elapsed, 8);
  EXPECT_EQ(line.arrive(8 + 240, {}).elapsed, 240);
  EXPECT_EQ(line.arrive(8 + 240, {}).elapsed, 0);  // the same again
}

// The first read returns several datagrams: nobody knows yet when the line was silent.
TEST(Stim300SampleClock, CountsOnWithinTheFirstRead) {
  SampleClock clock;
  (void)clock.update(250, kStart, Time::never());
  EXPECT_EQ(clock.update(2, kStart, Time::never()).elapsed, 8);
}

TEST(Stim300SampleClock, CountsTurnsOfTheCounterInASilence) {
  test::for_all(200, [](test::Generator& g) {
    SampleClock clock;
    const auto at = [](std::int64_t tick) { return kStart + Duration::from_ns(tick * kPeriod_ns); };
    (void)clock.update(0, at(0), Time::never());
    const std::int64_t tick = g.integer(1, 200'000);  // up to 100 s
    // The line was asked every 10 ms and had nothing.
    const Time t_silent = at(tick) - Duration::from_us(g.integer(0, 10'000));
    const SampleClock::Tick result = clock.update(static_cast<std::uint8_t>(tick), at(tick), t_silent);
    ASSERT_EQ(result.elapsed, tick);
  });
}

// The host was away for a second, and the datagrams of that time wait for it.
TEST(Stim300SampleClock, DoesNotTakeAnAbsentHostForASilentLine) {
  SampleClock clock;
  const auto at = [](std::int64_t tick) { return kStart + Duration::from_ns(tick * kPeriod_ns); };
  std::int64_t tick = 0;
  for (; tick < 800; tick += 8)
    (void)clock.update(static_cast<std::uint8_t>(tick), at(tick), at(tick) - Duration::from_ms(1));
  const Time t_silent = at(tick - 8) + Duration::from_ms(1);
  const Time t_back = at(tick + 2000);
  for (std::int64_t end = tick + 2000; tick <= end; tick += 8) {
    const SampleClock::Tick result = clock.update(static_cast<std::uint8_t>(tick), t_back, t_silent);
    ASSERT_EQ(result.elapsed, 8);
    ASSERT_LE(std::abs((result.t - at(tick)).ns()), 510'000) << tick;  // the drift it allows for, 500 ppm of 1 s
  }
}

TEST(Stim300SampleClock, GivesUpACountThatIsWrong) {
  Line line;
  for (std::int64_t tick = 0; tick < 800; tick += 8) (void)line.arrive(tick, {});
  EXPECT_EQ(line.clock.corrections(), 0U);
  // The unit was reset unseen: its counter is 50 ms back from what it was.
  SampleClock::Tick last;
  for (std::int64_t tick = 800; tick < 1600; tick += 8) last = line.arrive(tick, Duration::from_ms(50));
  EXPECT_EQ(line.clock.corrections(), 1U);
  EXPECT_LT(std::abs((last.t - line.true_time(1592)).seconds() - 0.05), 1e-4);
}

TEST(Stim300SampleClock, FollowsAnEarlierDatagramAtOnce) {
  Line line;
  (void)line.arrive(0, Duration::from_ms(20));  // the first one seen was late
  EXPECT_EQ(line.arrive(8, {}).t, line.true_time(8));
  EXPECT_EQ(line.arrive(16, Duration::from_ms(3)).t, line.true_time(16) + Duration::from_us(2));
}

TEST(Stim300SampleClock, BeginsAnewAfterARestart) {
  Line line;
  (void)line.arrive(0, {});
  line.clock.restart();
  const SampleClock::Tick tick = line.arrive(100, Duration::from_ms(7));
  EXPECT_TRUE(tick.first);
  EXPECT_EQ(tick.t, line.true_time(100) + Duration::from_ms(7));
}

}  // namespace
}  // namespace plumb::stim300
