// Which camera poses stay in the sliding window.

#include <gtest/gtest.h>

#include <vector>

#include "fsw/base/mission_config.h"
#include "test/support/estimator_feed.h"

namespace plumb {
namespace {

using Feed = test::EstimatorFeed<Estimator<FlightConfig>>;

constexpr double kInterval_s = VisionOptions{}.pose_interval_s;

/// Capture times of the images whose poses are in the window, oldest first.
std::vector<double> window_times(const Feed& feed, const std::vector<double>& image_times) {
  const FilterState<FlightConfig>& filter = feed.estimator->filter();
  std::vector<double> times;
  for (const std::size_t slot : filter.window()) times.push_back(image_times[filter.pose(slot).sequence]);
  return times;
}

/// Flies with this image rate and hands the window's times to `check` after every image.
template <typename Check>
void fly_at(double image_rate_hz, Check check) {
  sim::FlightSettings settings = test::quick_settings(true);
  settings.image_rate_hz = image_rate_hz;
  Feed feed(test::lively_scene(3.0), settings);
  std::vector<double> image_times;
  feed.on_frame = [&](Feed::Frame& frame) {
    image_times.push_back((frame.t - sim::flight_epoch()).seconds());
    return true;
  };
  feed.after_frame = [&](Status) {
    if (feed.estimator->state().valid) check(window_times(feed, image_times), image_times.back());
  };
  feed.fly_until(3.0);
}

TEST(PoseWindow, TheNewestPoseIsInAndOthersAreAnIntervalApart) {
  for (const double rate_hz : {7.0, 20.0, 30.0, 61.0, 120.0}) {
    std::size_t longest = 0;
    fly_at(rate_hz, [&](const std::vector<double>& times, double now) {
      EXPECT_EQ(times.back(), now);
      for (std::size_t i = 0; i + 2 < times.size(); ++i) EXPECT_GE(times[i + 1] - times[i], kInterval_s) << rate_hz;
      longest = std::max(longest, times.size());
    });
    EXPECT_EQ(longest, FlightConfig::kMaxPoses) << rate_hz;
  }
}

TEST(PoseWindow, AtALowRateEveryPoseStays) {
  fly_at(20.0, [](const std::vector<double>& times, double) {
    for (std::size_t i = 0; i + 1 < times.size(); ++i) EXPECT_LT(times[i + 1] - times[i], 1.5 / 20.0);
  });
}

// The range of a track belongs to the image that the track begins in, so that image has to stay.
TEST(PoseWindow, ATrackTakesARangeOnlyWhereThePoseStays) {
  sim::FlightSettings settings = test::quick_settings(true);
  settings.image_rate_hz = 60.0;
  settings.range_rate_hz = 60.0;
  Feed feed(test::lively_scene(3.0), settings);
  std::uint32_t image = 0;
  std::uint32_t ranged_image = 0;
  bool ranged = false;
  int taken = 0;
  feed.on_frame = [&](Feed::Frame& frame) {
    image = frame.sequence;
    return true;
  };
  feed.after_frame = [&](Status) {
    if (ranged) {
      EXPECT_LT(feed.estimator->filter().slot_of(ranged_image), FlightConfig::kMaxPoses);
    }
    ranged = feed.estimator->report().range_feature != 0;
    ranged_image = image;
    if (ranged) ++taken;
  };
  feed.fly_until(3.0);
  EXPECT_GT(taken, 20);
}

TEST(PoseWindow, WhileStandingTheOldestPosesStay) {
  const sim::Scene standing{"standing", sim::Trajectory(Vec3(0.0, 0.0, 5.0), 4.0), sim::flat_ground(),
                            sim::nadir_rig()};
  Feed feed(standing, test::quick_settings(false));
  feed.fly_until(2.0);
  ASSERT_TRUE(feed.estimator->state().valid);
  const FilterState<FlightConfig>& filter = feed.estimator->filter();
  const std::uint32_t oldest = filter.pose(filter.window().front()).sequence;
  const std::size_t poses = filter.window().size();
  feed.after_frame = [&](Status) {
    EXPECT_EQ(filter.pose(filter.window().front()).sequence, oldest);
    EXPECT_EQ(filter.window().size(), poses);
  };
  feed.fly_until(4.0);
}

}  // namespace
}  // namespace plumb
