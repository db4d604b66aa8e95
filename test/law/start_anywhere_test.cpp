// Wherever the flight software is switched on, it finds its state without help, soon, and knows how sure it is of it:
// on the ground with the lens 0.3 m above it, in hover, at constant velocity, after a reset in flight.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>

#include "fsw/base/mission_config.h"
#include "test/support/estimator_feed.h"
#include "test/support/sim/accuracy.h"

namespace plumb {
namespace {

using Feed = test::EstimatorFeed<Estimator<FlightConfig>>;

constexpr int kRuns = 10;
constexpr double kConfidence = 0.95;

struct Start {
  double delay_s = 0.0;               ///< from the first image, or the reset, to the first state
  double velocity_share = 0.0;        ///< error of the first velocity, of the true speed
  double velocity_error_m_s = 0.0;    ///< the same in itself
  sim::Nees nees;                     ///< of the first state
  std::optional<double> scale_error;  ///< of the distance flown from the first state to 10 s after it
};

constexpr double kUsualImu_hz = 250.0;

/// Flies one seed for `fly_s` from `from_s` on, where the flight software is switched on or reset.
Start start_of(const sim::Scene& scene, std::uint64_t seed, double from_s, double fly_s, double imu_hz) {
  sim::FlightSettings settings;
  settings.seed = seed;
  settings.imu_rate_hz = imu_hz;
  Feed feed(scene, settings);
  sim::FlightLog log;
  const auto since_epoch = [](Time t) { return (t - sim::flight_epoch()).seconds(); };
  feed.after_frame = [&](Status) {
    const NavState& state = feed.estimator->state();
    if (state.valid && since_epoch(state.t) > from_s) log.points.push_back(feed.point());
  };
  feed.fly_until(from_s);
  if (from_s > 0.0) feed.estimator->reset();
  feed.fly_until(from_s + fly_s);

  Start start;
  EXPECT_FALSE(log.points.empty()) << scene.name << ", seed " << seed;
  if (log.points.empty()) return start;
  const std::vector<sim::ErrorPoint> errors = sim::errors_of(log);
  const sim::FlightPoint& first = log.points.front();
  start.delay_s = first.t_s - from_s;
  start.velocity_error_m_s = errors.front().error.velocity_m_s.norm();
  start.velocity_share = start.velocity_error_m_s / first.truth.v_WI_m_s.norm();
  start.nees = errors.front().nees;
  constexpr double kScaleAfter_s = 10.0;
  for (const sim::FlightPoint& point : log.points) {
    if (point.t_s < first.t_s + kScaleAfter_s) continue;
    const auto moved = [](const std::array<double, 3>& a, const std::array<double, 3>& b) {
      return (Vec3(a.data()) - Vec3(b.data())).norm();
    };
    start.scale_error =
        moved(point.estimate.p_WI_m, first.estimate.p_WI_m) / (point.truth.p_WI_m - first.truth.p_WI_m).norm() - 1.0;
    break;
  }
  return start;
}

struct Limits {
  double delay_s = 0.0;
  double velocity_error_m_s = 0.0;
};

/// Every seed starts in time and right enough, and over the seeds the first covariance is not too small.
std::vector<Start> expect_starts(const sim::Scene& scene, double from_s, double fly_s, const Limits& limits,
                                 double imu_hz = kUsualImu_hz) {
  std::vector<Start> starts;
  double velocity = 0.0;
  double attitude = 0.0;
  double worst_delay_s = 0.0;
  double worst_velocity_m_s = 0.0;
  for (std::uint64_t seed = 1; seed <= kRuns; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    starts.push_back(start_of(scene, seed, from_s, fly_s, imu_hz));
    const Start& start = starts.back();
    EXPECT_LE(start.delay_s, limits.delay_s);
    EXPECT_LE(start.velocity_error_m_s, limits.velocity_error_m_s);
    velocity += start.nees.velocity / kRuns;
    attitude += start.nees.attitude / kRuns;
    worst_delay_s = std::max(worst_delay_s, start.delay_s);
    worst_velocity_m_s = std::max(worst_velocity_m_s, start.velocity_error_m_s);
  }
  const sim::Interval bounds = sim::nees_bounds(kConfidence, 3, kRuns);
  std::printf(
      "%s from %.0f s: first state after %.2f s at most, velocity error %.3f m/s at most, NEES velocity %.2f, "
      "attitude %.2f (at most %.2f)\n",
      scene.name.c_str(), from_s, worst_delay_s, worst_velocity_m_s, velocity, attitude, bounds.high);
  EXPECT_LT(velocity, bounds.high);
  EXPECT_LT(attitude, bounds.high);
  return starts;
}

/// Holds its place `height_m` up from before the first sample on, within `sway_m`.
sim::Scene hovering(double height_m, double sway_m) {
  constexpr double kLength_s = 12.0;
  sim::Trajectory flight(Vec3(0.0, 0.0, height_m), kLength_s);
  flight.lean(1.0)
      .oscillate(-5.0, kLength_s + 10.0, {sway_m, 0.0, 0.3 * sway_m}, 0.0, 0.31)
      .oscillate(-5.0, kLength_s + 10.0, {0.0, sway_m, 0.0}, 0.3 * sway_m, 0.23, 0.7);
  return {sway_m > 0.0 ? "swaying hover" : "still hover", flight, sim::stepped_ground(), sim::nadir_rig()};
}

TEST(StartAnywhere, OnTheGround) {
  expect_starts(sim::make_scene("outdoor_cruise"), 0.0, 2.0, {.delay_s = 1.0, .velocity_error_m_s = 0.01});
}

TEST(StartAnywhere, InAStillHover) {
  expect_starts(hovering(5.0, 0.0), 0.0, 2.0, {.delay_s = 1.0, .velocity_error_m_s = 0.02});
}

// It neither stands still, nor does it move far enough to see much in a second.
TEST(StartAnywhere, InASwayingHover) {
  expect_starts(hovering(5.0, 0.05), 0.0, 6.0, {.delay_s = 2.0, .velocity_error_m_s = 0.1});
}

// Straight down the window takes all the time it has, whatever the rate of the IMU.
TEST(StartAnywhere, OnALongWindowWithAFastImu) {
  constexpr double kFastImu_hz = 2000.0;
  for (const double imu_hz : {kUsualImu_hz, kFastImu_hz}) {
    expect_starts(sim::make_scene("vertical_descent"), 0.0, 2.0, {.delay_s = 1.5, .velocity_error_m_s = 0.5}, imu_hz);
  }
}

TEST(StartAnywhere, AtConstantVelocity) {
  constexpr double kSpeed_m_s = 2.0;
  for (const char* name : {"cruise_from_start", "cruise_from_start_stepped"}) {
    const std::vector<Start> starts =
        expect_starts(sim::make_scene(name), 0.0, 12.0, {.delay_s = 1.0, .velocity_error_m_s = 0.1 * kSpeed_m_s});
    for (const Start& start : starts) {
      ASSERT_TRUE(start.scale_error.has_value());
      EXPECT_LT(std::abs(*start.scale_error), 0.02);
    }
  }
}

TEST(StartAnywhere, AfterAResetInFlight) {
  constexpr double kSpeed_m_s = 2.0;
  constexpr double kCruising_s = 25.0;
  const std::vector<Start> starts = expect_starts(sim::make_scene("outdoor_cruise_stepped"), kCruising_s, 12.0,
                                                  {.delay_s = 1.0, .velocity_error_m_s = 0.1 * kSpeed_m_s});
  for (const Start& start : starts) {
    ASSERT_TRUE(start.scale_error.has_value());
    EXPECT_LT(std::abs(*start.scale_error), 0.02);
  }
}

// In lively motion the acceleration tells the scale, but half a second of it leaves centimetres a second of velocity.
// The first tracks take them away, and the covariance says by how much.
TEST(StartAnywhere, AfterResetsInLivelyMotion) {
  constexpr std::uint64_t kFlights = 8;
  constexpr int kResets = 4;
  constexpr double kStarts = kFlights * kResets;
  constexpr double kSoon_s = 0.5;
  double drift_m = 0.0;  // root mean square over the first second
  sim::Nees nees;
  for (std::uint64_t seed = 1; seed <= kFlights; ++seed) {
    sim::FlightSettings settings;
    settings.seed = seed;
    Feed feed(sim::make_scene("excitation"), settings);
    sim::FlightLog log;
    feed.after_frame = [&](Status) {
      if (feed.estimator->state().valid) log.points.push_back(feed.point());
    };
    for (int i = 0; i < kResets; ++i) {
      const double from_s = 16.0 + 3.0 * i;
      feed.fly_until(from_s);
      feed.estimator->reset();
      log.points.clear();
      feed.fly_until(from_s + 2.0);
      const std::vector<sim::ErrorPoint> errors = sim::errors_of(log);
      ASSERT_GT(errors.size(), 30U);
      const double first_s = errors.front().t_s;
      double squares = 0.0;
      int points = 0;
      for (const sim::ErrorPoint& point : errors) {
        if (point.t_s >= first_s + 1.0) break;
        squares += point.error.position_m.squaredNorm();
        ++points;
      }
      drift_m += std::sqrt(squares / points) / kStarts;
      const auto soon = std::find_if(errors.begin(), errors.end(),
                                     [&](const sim::ErrorPoint& point) { return point.t_s >= first_s + kSoon_s; });
      nees.position += soon->nees.position / kStarts;
      nees.velocity += soon->nees.velocity / kStarts;
    }
  }
  const sim::Interval bounds =
      sim::nees_bounds(kConfidence, 3, static_cast<int>(kFlights));  // resets of a flight agree
  std::printf(
      "lively motion: %.1f mm of drift in the first second; NEES %.1f s after the start: position %.2f, velocity "
      "%.2f (at most %.2f)\n",
      1e3 * drift_m, kSoon_s, nees.position, nees.velocity, bounds.high);
  EXPECT_LT(nees.position, bounds.high);
  EXPECT_LT(nees.velocity, bounds.high);
}

}  // namespace
}  // namespace plumb
