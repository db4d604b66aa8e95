#include "fsw/modes/sensor_health.h"

#include <gtest/gtest.h>

#include <set>

#include "test/support/property.h"

namespace plumb {
namespace {

constexpr double kSilence_s = 0.5;

class SensorHealthTest : public ::testing::Test {
 protected:
  static constexpr SensorTick kGood{.samples = 1, .accepted = 1};
  static constexpr SensorTick kBad{.samples = 1, .refused = 1};

  /// So many ticks of 50 ms.
  SensorState speak(int times, SensorTick what = kGood) {
    for (int i = 0; i < times; ++i) {
      t_ = t_ + Duration::from_ms(50);
      monitor_.step(t_, what);
    }
    return monitor_.health().state;
  }

  ModeOptions options_;
  SensorMonitor monitor_{options_, kSilence_s};
  Time t_ = Time::from_seconds(7);
};

TEST_F(SensorHealthTest, IsSilentUntilItSpeaksAndWhenItStops) {
  EXPECT_EQ(speak(5, {}), SensorState::kSilent);
  EXPECT_EQ(speak(1), SensorState::kOk);
  EXPECT_EQ(speak(10, {}), SensorState::kOk);
  EXPECT_EQ(speak(1, {}), SensorState::kSilent);
  EXPECT_EQ(monitor_.health().samples, 1U);
}

TEST_F(SensorHealthTest, IsDegradedThenRejectedAndRestoredByAFewGoodOnes) {
  speak(3);
  EXPECT_EQ(speak(options_.degraded_after - 1, kBad), SensorState::kOk);
  EXPECT_EQ(speak(1, kBad), SensorState::kDegraded);
  EXPECT_EQ(speak(options_.rejected_after - options_.degraded_after - 1, kBad), SensorState::kDegraded);
  EXPECT_EQ(speak(1, kBad), SensorState::kRejected);
  EXPECT_EQ(monitor_.health().refused_in_a_row, static_cast<std::uint32_t>(options_.rejected_after));
  EXPECT_EQ(speak(options_.restored_after - 1), SensorState::kRejected);
  EXPECT_NE(speak(1), SensorState::kRejected);
  EXPECT_EQ(speak(41), SensorState::kOk) << "and a second without refusals has passed";
}

TEST_F(SensorHealthTest, IsDegradedAtHalfItsRate) {
  speak(41);
  EXPECT_NEAR(monitor_.health().rate_hz, 20.0, 1.1);
  for (int i = 0; i < 30; ++i) {
    speak(3, {});
    speak(1);
  }
  EXPECT_EQ(monitor_.health().state, SensorState::kDegraded);
  EXPECT_EQ(speak(41), SensorState::kOk);
}

TEST_F(SensorHealthTest, IsDegradedWhenAShareIsRefusedThoughNeverManyInARow) {
  for (int i = 0; i < 20; ++i) {
    speak(1, kBad);
    speak(1);
  }
  EXPECT_EQ(monitor_.health().state, SensorState::kDegraded);
}

TEST_F(SensorHealthTest, ASilenceEndsWhatWasHeldAgainstIt) {
  speak(options_.rejected_after, kBad);
  EXPECT_EQ(monitor_.health().state, SensorState::kRejected);
  EXPECT_EQ(speak(20, {}), SensorState::kSilent);
  EXPECT_EQ(speak(1), SensorState::kOk);
}

// Two monitors that are told the same say the same, counts add up, and every state is entered and left.
TEST(SensorLaws, HoldWhateverIsTold) {
  std::set<SensorState> entered;
  std::set<SensorState> left;
  test::for_all(30, [&](test::Generator& g) {
    SensorMonitor monitor({}, kSilence_s);
    SensorMonitor again({}, kSilence_s);
    Time t = Time::from_seconds(1);
    std::uint64_t samples = 0;
    std::uint64_t refused = 0;
    std::int64_t kind = 0;
    for (int i = 0; i < 3000; ++i) {
      t = t + Duration::from_ms(g.integer(1, 60));
      if (g.integer(0, 30) == 0) kind = g.integer(0, 3);
      SensorTick tick;
      if (kind > 0) tick.samples = 1;
      if (kind == 1 || (kind == 3 && g.integer(0, 2) == 0)) tick.refused = 1;
      if (kind == 2) tick.accepted = 1;
      samples += tick.samples;
      refused += tick.refused;
      const SensorState before = monitor.health().state;
      const SensorState now = monitor.step(t, tick);
      ASSERT_EQ(again.step(t, tick), now);
      if (now == before) continue;
      entered.insert(now);
      left.insert(before);
    }
    EXPECT_EQ(monitor.health().samples, samples);
    EXPECT_EQ(monitor.health().refused, refused);
  });
  EXPECT_EQ(entered.size(), kSensorTable.size());
  EXPECT_EQ(left.size(), kSensorTable.size());
  EXPECT_EQ((1U << kSensorConditions.size()) - 1U, sensor_condition::kAll);
}

}  // namespace
}  // namespace plumb
