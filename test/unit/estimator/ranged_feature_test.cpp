// Ranges that go to the feature track at the laser's spot: where the spot is looked for, which ranges the tracks take,
// and that the scale of a flight can rest on them alone.

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "fsw/base/mission_config.h"
#include "fsw/modes/mode_machine.h"
#include "test/support/estimator_feed.h"
#include "test/support/sim/accuracy.h"

namespace plumb {
namespace {

using Feed = test::EstimatorFeed<Estimator<PaperConfig>>;

constexpr double kLength_s = 4.0;

sim::FlightSettings noise_free_settings() {
  sim::FlightSettings settings = test::quick_settings(true);
  settings.imu = sim::noise_free();
  settings.range.noise_m = 0.0;
  settings.tracker.pixel_noise_px = 0.0;
  return settings;
}

std::unique_ptr<Estimator<PaperConfig>> estimator_with(bool feature, bool facet, double facet_after_s) {
  return test::estimator_with<PaperConfig>(noise_free_settings(), [=](EstimatorOptions& options) {
    options.range.feature = feature;
    options.range.facet = facet;
    options.range.facet_after_s = facet_after_s;
  });
}

// Beam, lever arm and the motion between range and image: the point asked for is where the ray cast of the range hit.
TEST(RangedFeature, ItIsWantedWhereTheLaserHitTheGround) {
  constexpr double kSettled_s = 3.0;  // it starts a little off
  constexpr double kEnd_s = 5.0;
  const sim::Scene scene = test::lively_scene(kEnd_s);
  Feed feed(scene, noise_free_settings());
  RangeSample newest;
  feed.on_range = [&newest](RangeSample& sample) {
    newest = sample;
    return true;
  };
  int compared = 0;
  feed.on_frame = [&](Feed::Frame& frame) {
    const MotionPrediction asked = feed.estimator->predict_motion(frame.t);
    const bool settled = frame.t > sim::flight_epoch() + Duration::from_seconds(kSettled_s);
    if (!settled || asked.wanted.empty() || newest.t > frame.t) return true;
    const auto at = [&](Time t) { return scene.trajectory.at((t - sim::flight_epoch()).seconds()); };
    const sim::TruthState then = at(newest.t);
    const sim::TruthState now = at(frame.t);
    const Vec3 hit = scene.rig.beam_origin_m(then) + newest.range_m * scene.rig.beam_direction(then);
    const Vec3 seen = scene.rig.q_WC(now).conjugate() * (hit - scene.rig.p_WC_m(now));
    EXPECT_LT((asked.wanted.back() - seen.head<2>() / seen.z()).norm(), 5e-4);
    ++compared;
    return true;
  };
  feed.fly_until(kEnd_s);
  EXPECT_GT(compared, 20);
}

struct Outcomes {
  EstimatorCounters ranges;
  std::uint32_t tracks_used = 0;
};
Outcomes fly(bool feature, bool facet, double facet_after_s) {
  sim::FlightSettings settings = noise_free_settings();
  settings.range_rate_hz = 100.0;  // more than can have tracks of their own
  Feed feed(test::lively_scene(kLength_s), settings);
  feed.estimator = estimator_with(feature, facet, facet_after_s);
  Outcomes out;
  feed.after_frame = [&](Status) {
    out.tracks_used += feed.estimator->report().ranged_used;
    EXPECT_GE(feed.estimator->counters().ranges_feature, out.tracks_used);  // a range is in one track's rows at most
    const auto& features = feed.estimator->slam_features();
    EXPECT_LE(std::count_if(features.begin(), features.end(), [](const SlamFeature& f) { return f.ranged; }), 10);
  };
  feed.fly_until(kLength_s);
  out.ranges = feed.estimator->counters();
  const EstimatorCounters& c = out.ranges;
  const std::uint64_t filed = test::filed_ranges(c);
  EXPECT_LE(filed, c.ranges);
  EXPECT_GE(filed + 4, c.ranges);  // some wait for the next image
  return out;
}

TEST(RangedFeature, ARangeGoesToATrackOrToAFacetNeverToBoth) {
  const Outcomes both = fly(true, true, 0.0);
  EXPECT_GT(both.ranges.ranges_feature, 30U);
  EXPECT_GT(both.ranges.ranges_used, 5U);
  EXPECT_GT(both.tracks_used, 20U);
  const Outcomes sparing = fly(true, true, 1.0);  // facets until the first track takes a range, and none after it
  EXPECT_LT(sparing.ranges.ranges_used, both.ranges.ranges_used);
  EXPECT_GT(sparing.ranges.ranges_spare, 10U);
  const Outcomes feature = fly(true, false, 0.0);
  EXPECT_EQ(feature.ranges.ranges_used, 0U);
  EXPECT_GT(feature.ranges.ranges_feature, 30U);
  const Outcomes facet = fly(false, true, 1.0);
  EXPECT_EQ(facet.ranges.ranges_feature, 0U);
  EXPECT_EQ(facet.tracks_used, 0U);
  EXPECT_GT(facet.ranges.ranges_used, 30U);
}

// Nothing can be followed at the laser's spot any more: once no track with a range is left, the facet is asked.
TEST(RangedFeature, WithoutRangedTracksTheFacetIsAsked) {
  constexpr double kNoMore_s = 2.0;
  constexpr double kEnd_s = 7.0;         // features for facets wait two seconds for ranged tracks to tell the scale
  constexpr double kAboutTheSpot = 0.1;  // the beam is along the axis, the camera moves little between images
  Feed feed(test::lively_scene(kEnd_s), noise_free_settings());
  feed.estimator = estimator_with(true, true, 0.5);
  std::set<std::uint32_t> known;
  feed.on_frame = [&known](Feed::Frame& frame) {
    const bool open = (frame.t - sim::flight_epoch()).seconds() < kNoMore_s;
    frame.observations.erase_if([&](const FeatureObservation& o) {
      return !open && !known.contains(o.track_id) && Vec2(o.x, o.y).norm() < kAboutTheSpot;
    });
    for (const FeatureObservation& o : frame.observations) known.insert(o.track_id);
    return true;
  };
  feed.fly_until(kNoMore_s);
  EXPECT_GT(feed.estimator->counters().ranges_feature, 20U);
  const std::uint64_t before = feed.estimator->counters().ranges_used;
  feed.fly_until(kEnd_s);
  EXPECT_GT(feed.estimator->counters().ranges_used, before + 10);
  EXPECT_EQ(mode_at_image(feed.estimator->state(), {}), NavMode::kRangeVio);
}

// Every fifth range is too short by metres. Those that tracks took are found out by the tracks.
TEST(RangedFeature, AFalseEchoIsRefusedAndItsTrackUsed) {
  sim::FlightSettings settings = test::quick_settings(true);
  settings.range.outlier = 0.2;
  Feed feed(test::lively_scene(kLength_s), settings);
  std::uint32_t refused = 0;
  std::uint32_t tracks_refused = 0;
  feed.after_frame = [&](Status) {
    refused += feed.estimator->report().ranged_rejected;
    tracks_refused += feed.estimator->report().msckf_rejected;
  };
  feed.fly_until(kLength_s);
  EXPECT_GT(refused, 5U);
  EXPECT_LE(tracks_refused, 15U);                                                // 12 without false echoes
  EXPECT_LT(test::position_error(feed.estimator->state(), feed.truth()), 0.25);  // 0.16 without false echoes
}

// Constant velocity on a slope over blocks: neither IMU nor facets tell the scale here. A range taken at the image's
// time would be off by the height lost in between, one taken for a depth by the slant of the beam.
TEST(RangedFeature, ScaleRestsOnRangedFeaturesAlone) {
  const sim::Scene scene = sim::make_scene("descent");
  sim::FlightSettings settings = noise_free_settings();
  settings.start_from_truth = false;
  settings.range.noise_m = 0.01;
  settings.tracker.pixel_noise_px = 0.1;
  settings.tracker.target_tracks = 100;
  EstimatorOptions options = sim::matched_options(settings);
  options.range.facet = false;
  const sim::Accuracy accuracy = sim::evaluate(sim::fly<FlightConfig>(scene, settings, options));
  ASSERT_TRUE(accuracy.started);
  EXPECT_FALSE(accuracy.diverged);
  EXPECT_LT(std::abs(accuracy.cruise_scale_percent), 0.2);
}

}  // namespace
}  // namespace plumb
