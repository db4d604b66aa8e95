// What an IMU cannot tell: a hole in its samples, a knock in such a hole, readings at the end of their scale. The
// filter flies on through all of them, and its covariance says what it does not know, from the first second after on.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <ostream>
#include <string>

#include "fsw/base/mission_config.h"
#include "test/support/estimator_feed.h"
#include "test/support/sim/accuracy.h"

namespace plumb {
namespace {

using Feed = test::EstimatorFeed<Estimator<FlightConfig>>;

constexpr int kRuns = 20;
constexpr double kFault_s = 8.0;                                // from here
constexpr std::array<double, 3> kLookedAt_s = {0.5, 1.0, 3.0};  // after the fault is over
constexpr double kLength_s = 11.5;

struct Fault {
  std::string name;
  bool lively = false;              ///< moves and turns in all axes; else straight on at 2 m/s
  double hole_s = 0.0;              ///< without a sample
  double knock_m_s = 0.0;           ///< change of velocity within 30 ms of the fault's beginning
  double kick_rad = 0.0;            ///< turned to the side and back within 0.12 s
  double accel_scale_m_s2 = 160.0;  ///< where the accelerometer's scale ends
  double gyro_scale_rad_s = 35.0;

  friend std::ostream& operator<<(std::ostream& out, const Fault& fault) { return out << fault.name; }
};

sim::Scene scene_of(const Fault& fault) {
  if (fault.lively) return test::lively_scene(kLength_s);
  const Vec3 knock_m_s = fault.knock_m_s * Vec3(-0.6, 0.7, 0.4);
  constexpr double kTurns_hz = 10.0;
  sim::Trajectory flight(Vec3(0.0, 0.0, 6.0), kLength_s);
  flight.change_speed(-4.0, 2.0, {2.0, 0.0, 0.0})
      .change_speed(kFault_s, 0.03, knock_m_s)
      .change_speed(kFault_s + 1.0, 1.0, -knock_m_s)
      .oscillate(kFault_s, 0.12, Vec3::Zero(), fault.kick_rad, kTurns_hz);
  return {fault.name, flight, sim::flat_ground(), sim::nadir_rig()};
}

double seconds(Time t) { return (t - sim::flight_epoch()).seconds(); }

class ImuFaults : public testing::TestWithParam<Fault> {
 protected:
  /// Mean NEES at kLookedAt_s of one flight is added to `sums`.
  void fly(std::uint64_t seed, std::array<sim::Nees, kLookedAt_s.size()>& sums) {
    const Fault& fault = GetParam();
    const sim::Scene scene = scene_of(fault);
    sim::FlightSettings settings;
    settings.seed = seed;
    settings.tracker.target_tracks = 80;
    Feed feed(scene, settings);
    EstimatorOptions options = sim::matched_options(settings);
    options.imu.max_accel_m_s2 = fault.accel_scale_m_s2;
    options.imu.max_gyro_rad_s = fault.gyro_scale_rad_s;
    feed.estimator = std::make_unique<Estimator<FlightConfig>>(options, scene.rig.calibration());
    feed.on_imu = [&](ImuSample& sample) {
      const auto clip = [this](std::array<double, 3>& axes, double scale) {
        for (double& axis : axes) {
          if (std::abs(axis) > scale) ++clipped_;
          axis = std::clamp(axis, -scale, scale);
        }
      };
      clip(sample.accel_m_s2, fault.accel_scale_m_s2);
      clip(sample.gyro_rad_s, fault.gyro_scale_rad_s);
      return seconds(sample.t) <= kFault_s || seconds(sample.t) >= kFault_s + fault.hole_s;
    };
    sim::FlightLog log;
    feed.after_frame = [&](Status) {
      if (feed.estimator->state().valid) log.points.push_back(feed.point());
    };
    feed.fly_until(kFault_s);
    const double before_m_s = test::velocity_sigma(feed.estimator->state());
    feed.fly_until(kLength_s);
    EXPECT_LT(test::velocity_sigma(feed.estimator->state()), 2.0 * before_m_s) << "what it cost does not come back";
    EXPECT_EQ(feed.estimator->counters().resets, 0U);
    EXPECT_EQ(feed.estimator->counters().imu_invalid, 0U);
    const std::vector<sim::ErrorPoint> errors = sim::errors_of(log);
    for (std::size_t k = 0; k < kLookedAt_s.size(); ++k) {
      const double at_s = kFault_s + fault.hole_s + kLookedAt_s[k];
      const auto point = std::find_if(errors.begin(), errors.end(), [at_s](const auto& e) { return e.t_s >= at_s; });
      ASSERT_NE(point, errors.end());
      for (const sim::NeesPart& part : sim::kNeesOfVectors) sums[k].*part.member += point->nees.*part.member;
    }
  }

  int clipped_ = 0;
};

TEST_P(ImuFaults, AreFlownThroughAndTheCovarianceTellsWhatTheyCost) {
  std::array<sim::Nees, kLookedAt_s.size()> sums{};
  for (std::uint64_t seed = 1; seed <= kRuns; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    fly(seed, sums);
  }
  const bool ends_of_scale = GetParam().accel_scale_m_s2 < 160.0 || GetParam().gyro_scale_rad_s < 35.0;
  EXPECT_EQ(clipped_ > 0, ends_of_scale);
  const double looked_at = sim::kNeesOfVectors.size() * kLookedAt_s.size();
  const sim::Interval bounds = sim::nees_bounds(std::pow(0.95, 1.0 / looked_at), 3, kRuns);
  for (std::size_t k = 0; k < kLookedAt_s.size(); ++k) {
    for (const sim::NeesPart& part : sim::kNeesOfVectors) {
      const double mean = sums[k].*part.member / kRuns;
      std::printf("  NEES %s %.1f s after: %.2f, at most %.2f\n", part.name, kLookedAt_s[k], mean, bounds.high);
      EXPECT_LT(mean, bounds.high) << part.name;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(, ImuFaults,
                         testing::Values(Fault{.name = "HoleInLivelyFlight", .lively = true, .hole_s = 0.11},
                                         Fault{.name = "ShortHoleInLivelyFlight", .lively = true, .hole_s = 0.03},
                                         Fault{.name = "KnockInAHole", .hole_s = 0.11, .knock_m_s = 2.0},
                                         Fault{
                                             .name = "KnockBeyondTheScale", .knock_m_s = 2.0, .accel_scale_m_s2 = 60.0},
                                         Fault{.name = "KickBeyondTheScale", .kick_rad = 0.1, .gyro_scale_rad_s = 4.0}),
                         [](const auto& fault) { return fault.param.name; });

}  // namespace
}  // namespace plumb
