// Ranges where the laser stays, straight down: the feature at its spot, what the ranges that follow make of it, and
// which ranges may start one.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "fsw/base/mission_config.h"
#include "test/support/estimator_feed.h"

namespace plumb {
namespace {

using Feed = test::EstimatorFeed<Estimator<FlightConfig>>;

constexpr double kEnd_s = 6.0;
constexpr double kSpeed_m_s = 0.5;

/// 10 m up and slowly down, over flat ground.
sim::Scene slow_descent() {
  sim::Trajectory descent(Vec3(0.0, 0.0, 10.0), kEnd_s);
  descent.change_speed(-2.0, 1.0, Vec3(0.0, 0.0, -kSpeed_m_s)).lean(0.0);
  return {"slow descent", descent, sim::flat_ground(), sim::nadir_rig()};
}

/// Off the truth, as a share of it, the worst of the features that started from a range. Depths are those in the camera
/// that the feature is anchored in, at the height that its image was taken from.
double worst_ranged_depth(const Feed& feed, const std::vector<sim::TruthState>& images) {
  double worst = 0.0;
  const FilterState<FlightConfig>& filter = feed.estimator->filter();
  for (const SlamFeature& feature : filter.features) {
    if (!feature.ranged) continue;
    const sim::TruthState& then = images[filter.pose(feature.anchor_slot).sequence];
    const Vec3 ray_C = feature.parameters.head<2>().homogeneous();
    const Vec3 ray_W = sim::nadir_rig().q_WC(then) * ray_C;
    const double depth_m = -sim::nadir_rig().p_WC_m(then).z() / ray_W.z();
    worst = std::max(worst, std::abs(1.0 / (feature.parameters.z() * depth_m) - 1.0));
  }
  return worst;
}

std::size_t ranged_features(const Feed& feed) {
  const auto& features = feed.estimator->slam_features();
  return static_cast<std::size_t>(
      std::count_if(features.begin(), features.end(), [](const SlamFeature& f) { return f.ranged; }));
}

struct Flight {
  explicit Flight(const sim::FlightSettings& settings) : feed(slow_descent(), settings) {
    feed.after_frame = [this](Status) {
      images.push_back(feed.truth());
      const FrameReport& report = feed.estimator->report();
      compared += report.range_outcome == RangeOutcome::kUsed && report.range_feature != 0 ? 1 : 0;
    };
  }
  Feed feed;
  std::vector<sim::TruthState> images;
  int compared = 0;
};

TEST(LaserSpot, WhereItStaysAFeatureStartsAndRangesMeetIt) {
  Flight flight(test::quick_settings(true));
  flight.feed.fly_until(kEnd_s);
  EXPECT_GE(ranged_features(flight.feed), 1U);
  EXPECT_GT(flight.compared, 60);
  EXPECT_LT(worst_ranged_depth(flight.feed, flight.images), 0.02);
}

// One false echo in twenty, as if someone walked through the beam: none starts a feature, and none ends one.
TEST(LaserSpot, ASingleFalseEchoDoesNoHarm) {
  Flight flight(test::quick_settings(true));
  int count = 0;
  flight.feed.on_range = [&count](RangeSample& range) {
    if (++count % 20 == 0) range.range_m *= 0.4;
    return true;
  };
  flight.feed.fly_until(kEnd_s);
  EXPECT_GT(flight.compared, 50);
  EXPECT_LT(worst_ranged_depth(flight.feed, flight.images), 0.02);
}

// At first all ranges are too long. What starts from them ends with the first two that are right.
TEST(LaserSpot, AFeatureFromFalseRangesIsEndedByGoodOnes) {
  constexpr double kFalse_s = 2.0;
  Flight flight(test::quick_settings(true));
  flight.feed.on_range = [](RangeSample& range) {
    if ((range.t - sim::flight_epoch()).seconds() < kFalse_s) range.range_m *= 1.15;
    return true;
  };
  flight.feed.fly_until(kFalse_s);
  EXPECT_GT(worst_ranged_depth(flight.feed, flight.images), 0.1) << "nothing started from the false ones";
  flight.feed.fly_until(kEnd_s);
  EXPECT_LT(worst_ranged_depth(flight.feed, flight.images), 0.02);
}

}  // namespace
}  // namespace plumb
