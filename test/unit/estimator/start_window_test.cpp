// When the answer of the in-motion start is believed: at once when ranges or excitation tell the scale, after the
// longest window when nothing does.

#include "fsw/estimator/start_window.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "fsw/base/mission_config.h"
#include "test/support/estimator_feed.h"

namespace plumb {
namespace {

using Feed = test::EstimatorFeed<Estimator<PaperConfig>>;

sim::Scene cruise_scene() { return {"cruise", sim::cruise_from_start(8.0, 6.0), sim::flat_ground(), sim::nadir_rig()}; }

/// Seconds until the first valid state; infinite when there is none.
double time_to_start(Feed& feed, double limit_s) {
  double started_s = std::numeric_limits<double>::infinity();
  feed.after_frame = [&](Status) {
    if (!feed.estimator->state().valid) return;
    started_s = std::min(started_s, (feed.estimator->state().t - sim::flight_epoch()).seconds());
  };
  feed.fly_until(limit_s);
  return started_s;
}

TEST(StartWindow, RangesStartAConstantFlightEarly) {
  Feed feed(cruise_scene(), test::quick_settings(false));
  EXPECT_LT(time_to_start(feed, 3.0), 1.0);
  EXPECT_NEAR(Vec3(feed.estimator->state().v_WI_m_s.data()).norm(), 2.0, 0.2);
}

// A start fits one motion to its whole window and takes the IMU's word for it.
TEST(StartWindow, BeginsAfterAHoleInTheImu) {
  constexpr double kHole_s = 0.3;
  constexpr double kOver_s = 0.39;  // shorter than what is bridged in flight
  Feed feed(cruise_scene(), test::quick_settings(false));
  feed.on_imu = [](ImuSample& sample) {
    const double t_s = (sample.t - sim::flight_epoch()).seconds();
    return t_s < kHole_s || t_s > kOver_s;
  };
  const double started_s = time_to_start(feed, 3.0);
  EXPECT_GT(started_s, kOver_s + StartOptions{}.motion_window_s);
  EXPECT_LT(started_s, kOver_s + StartOptions{}.motion_window_s + 0.1);
}

// Its scale is not observable: no state is better than one that is wrong and sure of itself. The first ranges give it.
TEST(StartWindow, WithoutRangesAConstantFlightWaitsForThem) {
  constexpr double kFirstRange_s = 3.0;
  Feed feed(cruise_scene(), test::quick_settings(false));
  feed.on_range = [](RangeSample& range) { return (range.t - sim::flight_epoch()).seconds() > kFirstRange_s; };
  const double started_s = time_to_start(feed, 5.0);
  EXPECT_GT(started_s, kFirstRange_s);
  EXPECT_LT(started_s, kFirstRange_s + 1.0);
  const NavState& state = feed.estimator->state();
  const Mat15 p = Eigen::Map<const Mat15>(state.covariance.data());
  const double sigma_m_s = std::sqrt(p.block<3, 3>(3, 3).trace());
  EXPECT_LT(sigma_m_s, 0.5);
  EXPECT_NEAR(Vec3(state.v_WI_m_s.data()).norm(), 2.0, 3.0 * sigma_m_s);
}

TEST(StartWindow, AHoverStartsStandingOnceItIsSeenToBeStill) {
  sim::Trajectory still(Vec3(0.0, 0.0, 4.0), 4.0);
  Feed feed({"still", still, sim::flat_ground(), sim::nadir_rig()}, test::quick_settings(false));
  const double started_s = time_to_start(feed, 4.0);
  EXPECT_GT(started_s, StartOptions{}.still_window_s);
  EXPECT_LT(started_s, 1.5);
  EXPECT_LT(Vec3(feed.estimator->state().v_WI_m_s.data()).norm(), 0.05);
}

// What the report says of the ranges that started the filter is what the fit made of each.
TEST(StartWindow, OnlyRangesThatFitAreCountedAsUsed) {
  std::uint64_t sent = 0;
  std::uint64_t wrong = 0;
  Feed feed(cruise_scene(), test::quick_settings(false));
  feed.on_range = [&](RangeSample& range) {
    if (sent++ % 4 == 3) {
      range.range_m *= 2.0;
      ++wrong;
    }
    return true;
  };
  for (double t_s = 0.0; !feed.estimator->state().valid && t_s < 3.0; t_s += 0.05) feed.fly_until(t_s);
  const EstimatorCounters& counters = feed.estimator->counters();
  EXPECT_GE(wrong, 2U);
  EXPECT_GE(counters.ranges_gated, wrong - 1);  // the newest may be still to come
  EXPECT_GE(counters.ranges_used, 3U);
  EXPECT_LE(counters.ranges_used, sent - wrong);
}

TEST(StartWindow, StartsAtEveryImageRate) {
  for (const double rate_hz : {10.0, 20.0, 60.0}) {
    sim::FlightSettings settings = test::quick_settings(false);
    settings.image_rate_hz = rate_hz;
    Feed feed(cruise_scene(), settings);
    EXPECT_LT(time_to_start(feed, 4.0), 2.0) << rate_hz << " Hz";
  }
}

TEST(StartWindow, WithoutFeaturesItKeepsWaiting) {
  Feed feed(cruise_scene(), test::quick_settings(false));
  feed.on_frame = [](Feed::Frame& frame) {
    if ((frame.t - sim::flight_epoch()).seconds() < 2.5) frame.observations.clear();
    return true;
  };
  const double started_s = time_to_start(feed, 6.0);
  EXPECT_GT(started_s, 2.5);
  EXPECT_LT(started_s, 4.5);
}

}  // namespace
}  // namespace plumb
