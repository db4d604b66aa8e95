// Faults of the world: the estimator notices, says so, and flies on or starts again by itself.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "fsw/base/mission_config.h"
#include "fsw/modes/mode_machine.h"
#include "test/support/estimator_feed.h"
#include "test/support/property.h"

namespace plumb {
namespace {

using Feed = test::EstimatorFeed<Estimator<PaperConfig>>;

double seconds(Time t) { return (t - sim::flight_epoch()).seconds(); }

TEST(EstimatorRecovery, AGapInTheImuStartsItAnew) {
  Feed feed(test::lively_scene(7.0), test::quick_settings(true));
  feed.on_imu = [](ImuSample& s) { return seconds(s.t) < 2.0 || seconds(s.t) > 2.2; };
  feed.fly_until(1.99);
  EXPECT_TRUE(feed.estimator->state().valid);
  EXPECT_EQ(feed.estimator->state().reset_count, 0U);
  feed.fly_until(2.3);
  EXPECT_FALSE(feed.estimator->state().valid);
  EXPECT_EQ(mode_at_image(feed.estimator->state(), {}), NavMode::kInitialising);
  EXPECT_EQ(feed.estimator->state().reset_count, 1U);
  EXPECT_EQ(feed.estimator->counters().imu_gaps, 1U);
  EXPECT_EQ(feed.estimator->counters().imu_overflow, 0U);  // by the gap itself, not by what it leaves in the buffer
  EXPECT_EQ(feed.estimator->counters().resets, 1U);
  feed.fly_until(7.0);
  EXPECT_TRUE(feed.estimator->state().valid);
  EXPECT_EQ(feed.estimator->state().reset_count, 1U);
  const double speed = Vec3(feed.estimator->state().v_WI_m_s.data()).norm();
  EXPECT_NEAR(speed, feed.truth().v_WI_m_s.norm(), 0.3);
}

TEST(EstimatorRecovery, AShortLossOfImuSamplesIsFlownThrough) {
  Feed feed(test::lively_scene(4.0), test::quick_settings(true));
  feed.on_imu = [](ImuSample& s) { return seconds(s.t) < 2.0 || seconds(s.t) > 2.11; };
  feed.fly_until(4.0);
  EXPECT_TRUE(feed.estimator->state().valid);
  EXPECT_EQ(feed.estimator->counters().resets, 0U);
  EXPECT_LT(test::position_error(feed.estimator->state(), feed.truth()), 0.5);
}

TEST(EstimatorRecovery, SecondsWithoutFeaturesAreFlownThrough) {
  Feed feed(test::lively_scene(7.0), test::quick_settings(true));
  feed.on_frame = [](Feed::Frame& frame) {
    if (seconds(frame.t) > 2.0 && seconds(frame.t) < 4.5) frame.observations.clear();
    return true;
  };
  feed.fly_until(4.4);
  EXPECT_TRUE(feed.estimator->state().valid);
  EXPECT_EQ(mode_at_image(feed.estimator->state(), {}), NavMode::kInertial);
  feed.fly_until(7.0);
  EXPECT_TRUE(feed.estimator->state().valid);
  EXPECT_TRUE(test::all_finite(feed.estimator->state()));
  EXPECT_NE(mode_at_image(feed.estimator->state(), {}), NavMode::kInertial);
  EXPECT_EQ(feed.estimator->counters().resets, 0U);
  EXPECT_LT(test::position_error(feed.estimator->state(), feed.truth()), 2.0);
}

TEST(EstimatorRecovery, SecondsWithoutImagesAreFlownThrough) {
  Feed feed(test::lively_scene(6.0), test::quick_settings(true));
  feed.on_frame = [](Feed::Frame& frame) { return seconds(frame.t) < 2.0 || seconds(frame.t) > 4.0; };
  feed.fly_until(6.0);
  EXPECT_TRUE(feed.estimator->state().valid);
  EXPECT_EQ(feed.estimator->counters().resets, 0U);
  EXPECT_LT(test::position_error(feed.estimator->state(), feed.truth()), 2.0);
}

// Without images nothing asks for the samples, which are more than the buffer holds in five seconds.
TEST(EstimatorRecovery, AnOutageLongerThanTheImuBufferIsFlownThrough) {
  for (const double rate_hz : {2000.0, 4000.0}) {
    SCOPED_TRACE(rate_hz);
    sim::FlightSettings settings = test::quick_settings(true);
    settings.imu_rate_hz = rate_hz;
    Feed feed(test::lively_scene(10.0), settings);
    feed.on_frame = [](Feed::Frame& frame) { return seconds(frame.t) < 2.0 || seconds(frame.t) > 7.0; };
    feed.fly_until(10.0);
    EXPECT_TRUE(feed.estimator->state().valid);
    EXPECT_EQ(feed.estimator->counters().resets, 0U);
    EXPECT_NEAR(seconds(feed.estimator->state().t), 10.0, 0.1);
    EXPECT_LT(test::position_error(feed.estimator->state(), feed.truth()), 2.0);
  }
}

TEST(EstimatorRecovery, AnOutageThatLeavesNothingOfTheStateStartsItAnew) {
  Feed feed(test::lively_scene(14.0), test::quick_settings(true));
  feed.on_frame = [](Feed::Frame& frame) { return seconds(frame.t) < 2.0 || seconds(frame.t) > 10.5; };
  feed.fly_until(14.0);
  EXPECT_TRUE(feed.estimator->state().valid);
  EXPECT_EQ(feed.estimator->counters().resets, 1U);
  EXPECT_EQ(feed.estimator->counters().imu_overflow, 1U);
}

TEST(EstimatorRecovery, ANumericalFaultIsCountedAndStartsItAnew) {
  test::for_all(4, [](test::Generator& g) {
    Feed feed(test::lively_scene(6.0), test::quick_settings(false));
    NavState poison;
    poison.q_WI = {1.0, 0.0, 0.0, 0.0};
    const double nan = std::numeric_limits<double>::quiet_NaN();
    switch (g.integer(0, 3)) {
      case 0: poison.p_WI_m[1] = nan; break;
      case 1: poison.v_WI_m_s[2] = std::numeric_limits<double>::infinity(); break;
      case 2: poison.b_gyro_rad_s[0] = nan; break;
      default: poison.q_WI = {0.0, nan, 0.0, 0.0}; break;
    }
    feed.estimator->start_from(poison);
    Status first = Status::kOk;
    feed.after_frame = [&](Status status) {
      if (feed.estimator->counters().frames == 1) first = status;
      EXPECT_TRUE(!feed.estimator->state().valid || test::all_finite(feed.estimator->state()));
    };
    feed.fly_until(0.1);
    EXPECT_EQ(first, Status::kNumericalFault);
    EXPECT_EQ(feed.estimator->counters().numerical_faults, 1U);
    EXPECT_EQ(feed.estimator->counters().resets, 1U);
    EXPECT_FALSE(feed.estimator->state().valid);
    feed.fly_until(6.0);
    EXPECT_TRUE(feed.estimator->state().valid);
    EXPECT_EQ(feed.estimator->counters().numerical_faults, 1U);
  });
}

// All state stands in the object: two of them side by side are as good as two alone, and one that was reset flies like
// a new one (F19).
TEST(EstimatorRecovery, InstancesShareNothing) {
  const sim::Scene scene = test::lively_scene(2.0);
  Feed alone(scene, test::quick_settings(true));
  alone.fly_until(2.0);
  Feed a(scene, test::quick_settings(true));
  sim::FlightSettings other = test::quick_settings(true);
  other.seed = 7;
  Feed b(scene, other);
  for (double t_s = 0.0; t_s <= 2.0; t_s += 0.1) {
    a.fly_until(t_s);
    b.fly_until(t_s);
  }
  a.fly_until(2.0);
  b.fly_until(2.0);
  EXPECT_EQ(a.estimator->state_hash(), alone.estimator->state_hash());
  EXPECT_NE(b.estimator->state_hash(), alone.estimator->state_hash());
}

TEST(EstimatorRecovery, AResetForgetsEverything) {
  // Nothing comes for longer than samples are kept: what was before it, if it is not forgotten, can only be state.
  constexpr double kReset_s = 2.0;
  constexpr double kBack_s = 5.0;
  constexpr double kEnd_s = 7.0;
  const sim::Scene scene = test::lively_scene(kEnd_s);
  const auto lose = [](Feed& feed, double from_s) {
    const auto kept = [from_s](Time t) {
      const double t_s = (t - sim::flight_epoch()).seconds();
      return t_s < from_s || t_s > kBack_s;
    };
    feed.on_imu = [kept](ImuSample& sample) { return kept(sample.t); };
    feed.on_range = [kept](RangeSample& sample) { return kept(sample.t); };
    feed.on_frame = [kept](Feed::Frame& frame) { return kept(frame.t); };
  };
  Feed fresh(scene, test::quick_settings(false));
  Feed flown(scene, test::quick_settings(false));
  for (Feed* feed : {&fresh, &flown})  // or the tracker, which is not reset, would have been asked for other features
    feed->estimator = test::facet_only(test::quick_settings(false));
  lose(fresh, 0.0);
  lose(flown, kReset_s);
  flown.fly_until(kReset_s);
  ASSERT_TRUE(flown.estimator->state().valid);
  const std::uint64_t of_a_new_one = fresh.estimator->state_hash();
  EXPECT_NE(flown.estimator->state_hash(), of_a_new_one);
  flown.estimator->reset();
  EXPECT_EQ(flown.estimator->state_hash(), of_a_new_one);
  EXPECT_EQ(flown.estimator->state().reset_count, 1U);
  EXPECT_FALSE(flown.estimator->state().valid);
  flown.fly_until(kEnd_s);
  fresh.fly_until(kEnd_s);
  ASSERT_TRUE(fresh.estimator->state().valid);
  EXPECT_EQ(flown.estimator->state_hash(), fresh.estimator->state_hash());
}

template <class Config>
void expect_repeatable() {
  using ConfigFeed = test::EstimatorFeed<Estimator<Config>>;
  const auto hashes = [] {
    ConfigFeed feed(test::lively_scene(4.0), test::quick_settings(false));
    std::vector<std::uint64_t> out;
    feed.after_frame = [&](Status) { out.push_back(feed.estimator->state_hash()); };
    feed.fly_until(4.0);
    EXPECT_TRUE(feed.estimator->state().valid);
    return out;
  };
  const std::vector<std::uint64_t> first = hashes();
  EXPECT_EQ(first.size(), 120U);
  EXPECT_EQ(first, hashes());
}

TEST(EstimatorRecovery, TwoRunsAreEqualInEveryBitOfEveryFrame) {
  expect_repeatable<PaperConfig>();
  expect_repeatable<FlightConfig>();
}

}  // namespace
}  // namespace plumb
