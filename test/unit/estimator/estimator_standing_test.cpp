// What the estimator makes of standing still, as a whole: both the images and the IMU must say so, and what it then
// takes from it is no more than they know.

#include <gtest/gtest.h>

#include <cmath>

#include "fsw/base/mission_config.h"
#include "fsw/modes/mode_machine.h"
#include "test/support/estimator_feed.h"

namespace plumb {
namespace {

using Feed = test::EstimatorFeed<Estimator<PaperConfig>>;

constexpr double kSeen_s = 2.0;  // by then standing has been noticed
constexpr double kEnd_s = 5.0;

sim::Scene standing_scene() {
  return {"standing", sim::Trajectory(Vec3(0.0, 0.0, 5.0), kEnd_s), sim::flat_ground(), sim::nadir_rig()};
}

TEST(EstimatorStanding, HoldsThePlaceWithoutAnyTruth) {
  Feed feed(standing_scene(), test::quick_settings(false));
  feed.fly_until(kSeen_s);
  ASSERT_TRUE(feed.estimator->state().valid);
  const Vec3 place(feed.estimator->state().p_WI_m.data());
  feed.after_frame = [&](Status) { EXPECT_TRUE(feed.estimator->report().zero_velocity); };
  feed.fly_until(kEnd_s);
  EXPECT_LT((Vec3(feed.estimator->state().p_WI_m.data()) - place).norm(), 0.02);
}

TEST(EstimatorStanding, ImagesThatStandStillAreNotEnough) {
  Feed feed(standing_scene(), test::quick_settings(false));
  feed.fly_until(kSeen_s);
  EXPECT_TRUE(feed.estimator->report().zero_velocity);
  feed.on_imu = [](ImuSample& sample) {
    sample.accel_m_s2[0] += std::sin(120.0 * (sample.t - sim::flight_epoch()).seconds());
    return true;
  };
  feed.fly_until(kSeen_s + 0.3);
  feed.after_frame = [&](Status) { EXPECT_FALSE(feed.estimator->report().zero_velocity); };
  feed.fly_until(kEnd_s);
}

// It moves, says the filter, and no standstill that it refuses may pass for evidence that holds its state.
TEST(EstimatorStanding, AStandstillThatIsRefusedCountsForNothing) {
  const sim::FlightSettings settings = test::quick_settings(false);
  Feed feed(standing_scene(), settings);
  feed.estimator = test::estimator_with<PaperConfig>(settings, [](EstimatorOptions& options) {
    options.vision.min_parallax_px = 200.0;  // so that no feature holds it either, until they need not wait any more
    options.vision.ranged_min_parallax_px = 200.0;
  });
  NavState moving;
  moving.q_WI = {1.0, 0.0, 0.0, 0.0};
  moving.v_WI_m_s = {1.0, 0.0, 0.0};
  feed.estimator->start_from(moving);
  feed.after_frame = [&](Status) { EXPECT_FALSE(feed.estimator->report().zero_velocity); };
  feed.fly_until(kSeen_s - 0.2);
  EXPECT_EQ(mode_at_image(feed.estimator->state(), {}), NavMode::kInertial);
}

// What one window of images can hide, all images in it hide: six times as many of them say no more.
TEST(EstimatorStanding, MoreImagesAreNoMoreEvidence) {
  const auto sigma_at = [](double image_rate_hz) {
    sim::FlightSettings settings = test::quick_settings(false);
    settings.image_rate_hz = image_rate_hz;
    Feed feed(standing_scene(), settings);
    feed.fly_until(kEnd_s);
    EXPECT_TRUE(feed.estimator->report().zero_velocity);
    return test::velocity_sigma(feed.estimator->state());
  };
  EXPECT_GT(sigma_at(60.0), 0.8 * sigma_at(10.0));
}

}  // namespace
}  // namespace plumb
