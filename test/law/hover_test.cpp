// Standing and hovering: what does not move teaches nothing. The estimate stays where it is, depths that nothing
// measures stay as uncertain as they are (the direction that ranges leave free in hover, paper section IV), and smooth
// flight is not taken for standing.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <map>

#include "fsw/base/mission_config.h"
#include "test/support/estimator_feed.h"
#include "test/support/sim/accuracy.h"

namespace plumb {
namespace {

using Feed = test::EstimatorFeed<Estimator<FlightConfig>>;
using Layout = ErrorLayout<FlightConfig>;

constexpr int kRuns = 10;

sim::FlightSettings settings_of(std::uint64_t seed) {
  sim::FlightSettings settings;
  settings.seed = seed;
  return settings;
}

/// A minute above one place after a climb. The largest distance from where the hover began, and the final NEES.
TEST(Hover, HoldsThePlaceForAMinute) {
  constexpr double kHovering_s = 20.0;
  constexpr double kEnd_s = 80.0;
  constexpr double kMaxDrift_m = 0.02;
  const Vec3 ground_m = sim::nadir_rig().ground_position_m(0.3);
  const sim::Scene scene{"hover", sim::hover(ground_m, 11.0, kEnd_s), sim::stepped_ground(), sim::nadir_rig()};
  double worst_m = 0.0;
  double nees = 0.0;
  for (std::uint64_t seed = 1; seed <= kRuns; ++seed) {
    Feed feed(scene, settings_of(seed));
    Vec3 begin_m = Vec3::Zero();
    double drift_m = 0.0;
    sim::FlightLog log;
    feed.after_frame = [&](Status) {
      log.points.push_back(feed.point());
      const Vec3 place_m(log.points.back().estimate.p_WI_m.data());
      if (log.points.back().t_s < kHovering_s) begin_m = place_m;
      drift_m = std::max(drift_m, (place_m - begin_m).norm());
    };
    feed.fly_until(kEnd_s);
    EXPECT_LT(drift_m, kMaxDrift_m) << "seed " << seed;
    worst_m = std::max(worst_m, drift_m);
    nees += sim::errors_of(log).back().nees.position / kRuns;
  }
  const sim::Interval bounds = sim::nees_bounds(0.95, 3, kRuns);
  std::printf("hover of 60 s: largest drift %.4f m, position NEES at the end %.2f (%.2f to %.2f)\n", worst_m, nees,
              bounds.low, bounds.high);
  EXPECT_LT(nees, bounds.high);
}

// Depths in the state, over steps of unknown height, against the truth along the same rays: as wrong as the filter
// says, no more, also after half a minute in which the same images and ranges came a thousand times.
TEST(Hover, DepthsThatNothingMeasuresStayUncertain) {
  constexpr double kEnd_s = 50.0;
  const Vec3 ground_m = sim::nadir_rig().ground_position_m(0.3);
  const sim::Scene scene{"hover", sim::hover(ground_m, 11.0, kEnd_s), sim::stepped_ground(), sim::nadir_rig()};
  double sum = 0.0;
  int features = 0;
  int outside = 0;
  for (std::uint64_t seed = 1; seed <= kRuns; ++seed) {
    Feed feed(scene, settings_of(seed));
    std::map<std::uint32_t, sim::TruthState> truth;  // by image
    std::uint32_t image = 0;
    feed.after_frame = [&](Status) { truth[image++] = feed.truth(); };
    feed.fly_until(kEnd_s);
    const FilterState<FlightConfig>& filter = feed.estimator->filter();
    for (std::size_t i = 0; i < filter.features.size(); ++i) {
      const SlamFeature& feature = filter.features[i];
      const sim::TruthState& then = truth[filter.pose(feature.anchor_slot).sequence];
      const Vec3 ray_C = feature.parameters.head<2>().homogeneous().normalized();
      const auto hit = scene.world.cast(scene.rig.p_WC_m(then), scene.rig.q_WC(then) * ray_C, 200.0);
      ASSERT_TRUE(hit.has_value());
      const double rho = 1.0 / (hit->range_m * ray_C.z());
      const std::size_t at = Layout::feature(i) + 2;
      const double sigma = std::sqrt(filter.covariance()(at, at));
      const double normalised = (feature.parameters.z() - rho) / sigma;
      sum += normalised * normalised;
      outside += std::abs(normalised) > 3.0 ? 1 : 0;
      ++features;
    }
  }
  std::printf("hover: %d depths, mean squared error over variance %.2f, %d beyond three sigmas\n", features,
              sum / features, outside);
  EXPECT_GT(features, 10 * kRuns);
  // Features of one flight share what the climb has taught of the scale: a mean as of the flights, not of the features.
  EXPECT_LT(sum / features, sim::nees_bounds(0.95, 1, kRuns).high);
  EXPECT_LT(outside, features / 20);
}

// Constant velocity is as quiet as standing to the IMU, and slow motion nearly so to the camera.
TEST(Hover, SmoothFlightIsNotStanding) {
  for (const char* name : {"cruise_from_start", "descent"}) {
    Feed feed(sim::make_scene(name), settings_of(1));
    int stands = 0;
    feed.after_frame = [&](Status) { stands += feed.estimator->report().zero_velocity ? 1 : 0; };
    feed.fly_until(20.0);
    EXPECT_EQ(stands, 0) << name;
  }
}

}  // namespace
}  // namespace plumb
