#include "fsw/vision/tracker_options.h"

#include <gtest/gtest.h>

#include <limits>

#include "test/unit/vision/lenses.h"

namespace plumb {
namespace {

constexpr std::size_t kMaxTracks = 200;

template <class Spoil>
Status check_with(Spoil spoil) {
  TrackerOptions options;
  spoil(options);
  return TrackerOptions::check(options, test::euroc_lens(), kMaxTracks);
}

TEST(TrackerOptions, DefaultsFitTheShippedCameras) {
  EXPECT_EQ(check_with([](TrackerOptions&) {}), Status::kOk);
  EXPECT_EQ(TrackerOptions::check(TrackerOptions{}, test::fisheye_lens(), kMaxTracks), Status::kOk);
}

TEST(TrackerOptions, RefusesWhatIsOutOfRange) {
  constexpr double kNotANumber = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(check_with([](TrackerOptions& o) { o.max_features = 201; }), Status::kInvalidValue);
  EXPECT_EQ(check_with([](TrackerOptions& o) { o.max_features = 0; }), Status::kInvalidValue);
  EXPECT_EQ(check_with([](TrackerOptions& o) { o.tile_columns = 0; }), Status::kInvalidValue);
  EXPECT_EQ(check_with([](TrackerOptions& o) { o.tile_rows = 9; }), Status::kInvalidValue);
  EXPECT_EQ(check_with([](TrackerOptions& o) { o.min_distance_px = -1; }), Status::kInvalidValue);
  EXPECT_EQ(check_with([](TrackerOptions& o) { o.border_px = 3; }), Status::kInvalidValue);
  EXPECT_EQ(check_with([](TrackerOptions& o) { o.border_px = 240; }), Status::kInvalidValue);
  EXPECT_EQ(check_with([](TrackerOptions& o) { o.fast_threshold_min = 60; }), Status::kInvalidValue);
  EXPECT_EQ(check_with([](TrackerOptions& o) { o.fast_threshold_max = 256; }), Status::kInvalidValue);
  EXPECT_EQ(check_with([](TrackerOptions& o) { o.window_px = 14; }), Status::kInvalidValue);
  EXPECT_EQ(check_with([](TrackerOptions& o) { o.levels = 7; }), Status::kInvalidValue);
  EXPECT_EQ(check_with([](TrackerOptions& o) { o.max_iterations = 0; }), Status::kInvalidValue);
  EXPECT_EQ(check_with([](TrackerOptions& o) { o.epsilon_px = 0.0; }), Status::kInvalidValue);
  EXPECT_EQ(check_with([](TrackerOptions& o) { o.outlier_px = kNotANumber; }), Status::kInvalidValue);
  EXPECT_EQ(check_with([](TrackerOptions& o) { o.min_similarity = 1.5; }), Status::kInvalidValue);
}

TEST(TrackerOptions, RefusesABadCalibration) {
  CameraCalibration bad = test::euroc_lens();
  bad.fx = 0.0;
  EXPECT_EQ(TrackerOptions::check(TrackerOptions{}, bad, kMaxTracks), Status::kInvalidValue);
}

}  // namespace
}  // namespace plumb
