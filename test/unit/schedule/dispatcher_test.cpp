#include "fsw/schedule/dispatcher.h"

#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "hal/replay/replay_clock.h"

namespace plumb {
namespace {

constexpr std::array<Job, 3> kTable{{
    {.name = "first", .budget = Duration::from_us(100), .outputs = 1},
    {.name = "beside",
     .thread = Thread::kOwn,
     .period_ticks = 4,
     .budget = Duration::from_us(900),
     .logical_ticks = 4,
     .inputs = 1,
     .outputs = 2},
    {.name = "second", .period_ticks = 2, .budget = Duration::from_us(200), .inputs = 1, .outputs = 4},
}};
static_assert(check_schedule<kTable, 0>());

struct Bench {
  Dispatcher<kTable> dispatcher;
  ReplayClock clock;
  std::vector<std::size_t> ran;
  std::vector<ScheduleFact> facts;
  Time t_tick = Time::from_ns(0);

  /// One tick, every job of which takes `took`, `late` after its time.
  void tick(std::uint64_t number, Duration took, Duration late = Duration()) {
    clock.wait_until(t_tick + kTickPeriod * static_cast<std::int64_t>(number) + late);
    dispatcher.dispatch(
        number, [this] { return clock.now(); },
        [&](std::size_t row) {
          ran.push_back(row);
          clock.wait_until(clock.now() + took);
        },
        [this](const ScheduleFact& fact) { facts.push_back(fact); });
  }
};

TEST(Dispatcher, RunsWhatIsDueInTheOrderOfTheTable) {
  Bench bench;
  for (std::uint64_t tick = 0; tick < 4; ++tick) bench.tick(tick, Duration::from_us(1));
  EXPECT_EQ(bench.ran, (std::vector<std::size_t>{0, 2, 0, 0, 2, 0}));
  EXPECT_EQ(bench.dispatcher.of(0).runs(), 4U);
  EXPECT_EQ(bench.dispatcher.of(2).runs(), 2U);
  EXPECT_EQ(bench.dispatcher.of(1).runs(), 0U);
  EXPECT_TRUE(bench.facts.empty());
}

TEST(Dispatcher, KeepsLastMeanAndLongestTime) {
  Bench bench;
  bench.tick(0, Duration::from_us(10));
  bench.tick(1, Duration::from_us(60));
  bench.tick(2, Duration::from_us(20));
  EXPECT_EQ(bench.dispatcher.of(0).last(), Duration::from_us(20));
  EXPECT_EQ(bench.dispatcher.of(0).max(), Duration::from_us(60));
  EXPECT_EQ(bench.dispatcher.of(0).mean(), Duration::from_us(30));
}

TEST(Dispatcher, LongRunIsAnOverrunAndNoSlip) {
  Bench bench;
  bench.tick(0, Duration::from_us(100));  // just in time for the first job
  bench.tick(1, Duration::from_us(101));
  EXPECT_EQ(bench.dispatcher.of(0).overruns(), 1U);
  EXPECT_EQ(bench.dispatcher.of(0).slips(), 0U);
  ASSERT_EQ(bench.facts.size(), 1U);
  EXPECT_EQ(bench.facts[0].kind, ScheduleFact::Kind::kOverrun);
  EXPECT_EQ(bench.facts[0].time, Duration::from_us(101));
}

TEST(Dispatcher, MissedPeriodsAreSlipsAndNoOverrun) {
  Bench bench;
  bench.tick(0, Duration::from_us(1));
  bench.tick(1, Duration::from_us(1), Duration::from_ms(3));  // late, but no period was left out
  EXPECT_EQ(bench.dispatcher.of(0).slips(), 0U);
  bench.tick(2, Duration::from_us(1), Duration::from_ms(12));
  EXPECT_EQ(bench.dispatcher.of(0).slips(), 2U);
  EXPECT_EQ(bench.dispatcher.of(2).slips(), 1U) << "its period is two ticks";
  EXPECT_EQ(bench.dispatcher.of(0).overruns(), 0U);
}

TEST(Dispatcher, TellsOfAStreamOfOverrunsOncePerSecondAndCountsAll) {
  Bench bench;
  constexpr std::uint64_t kTicks = 2500;  // 10 s
  for (std::uint64_t tick = 0; tick < kTicks; ++tick) bench.tick(tick, Duration::from_us(150));
  EXPECT_EQ(bench.dispatcher.of(0).overruns(), kTicks);
  std::uint64_t told = 0;
  std::uint64_t suppressed = 0;
  for (const ScheduleFact& fact : bench.facts) {
    if (fact.job != 0) continue;
    ++told;
    suppressed += fact.suppressed;
  }
  EXPECT_NEAR(static_cast<double>(told), JobAccount::kBurst + 9.0, 1.0);
  EXPECT_LE(told + suppressed, kTicks);
  EXPECT_GE(told + suppressed, kTicks - 250) << "all but those since the last one that was told";
}

}  // namespace
}  // namespace plumb
