// The tracker on the flight kernels beside the same tracker on OpenCV's, over whole sequences: it loses no more tracks,
// sees the same features in the same places, and asks for no memory.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <opencv2/core/utility.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "fsw/vision/flight_tracker.h"
#include "test/support/data.h"
#include "test/support/opencv_tracker/opencv_tracker.h"
#include "test/unit/vision/lenses.h"
#include "test/unit/vision/painted_scene.h"
#include "tools/replay/heap_counter.h"

namespace plumb {
namespace {

using Frame = FeatureFrame<FlightConfig::kMaxTracks>;
using Oracle = OpenCvTracker<FlightConfig::kMaxTracks>;
using Flown = FlightTracker<FlightConfig>;

constexpr std::int64_t kInterval_ns = 50'000'000;

/// What a tracker made of a sequence.
struct Score {
  std::uint64_t asked = 0;  ///< tracks that were alive before an image, over all images
  std::uint64_t kept = 0;   ///< those that still were after it
  std::uint64_t seen = 0;   ///< features reported

  double kept_share() const { return static_cast<double>(kept) / static_cast<double>(asked); }
};

template <class ATracker>
void track(ATracker& tracker, const ImageView& image, int index, const MotionPrediction& motion, Frame& out,
           Score& score) {
  const CameraFrame frame{Time::from_ns(1 + index * kInterval_ns), static_cast<std::uint32_t>(index), image};
  ASSERT_EQ(tracker.track(frame, motion, out), Status::kOk);
  const TrackerReport& report = tracker.report();
  score.asked += report.before;
  score.kept += out.observations.size() - report.started;
  score.seen += out.observations.size();
}

class BothTrackers {
 public:
  BothTrackers(const CameraCalibration& lens, const TrackerOptions& options)
      : oracle_(std::make_unique<Oracle>(lens, options)), flown_(std::make_unique<Flown>(lens, options)) {
    cv::setNumThreads(1);
  }

  void track(const ImageView& image, const MotionPrediction& motion) {
    plumb::track(*oracle_, image, images_, motion, frame_, oracle_score);
    const std::uint64_t before = replay::heap_calls();
    plumb::track(*flown_, image, images_, motion, frame_, flown_score);
    heap_calls += replay::heap_calls() - before;
    ++images_;
  }
  void expect_no_worse() const {
    EXPECT_GE(flown_score.kept_share(), oracle_score.kept_share() - 0.002);
    EXPECT_GE(static_cast<double>(flown_score.seen), 0.99 * static_cast<double>(oracle_score.seen));
    EXPECT_EQ(heap_calls, 0U);
    ::testing::Test::RecordProperty("kept", std::to_string(flown_score.kept_share()));
    ::testing::Test::RecordProperty("kept by OpenCV", std::to_string(oracle_score.kept_share()));
  }

  Score oracle_score;
  Score flown_score;
  std::uint64_t heap_calls = 0;

 private:
  std::unique_ptr<Oracle> oracle_;
  std::unique_ptr<Flown> flown_;
  Frame frame_;
  int images_ = 0;
};

TEST(TrackerComparison, KeepsAsManyTracksOverAPaintedWall) {
  test::Generator g(test::base_seed());
  const test::PaintedWall wall(g);
  const CameraModel camera(test::small_lens());
  TrackerOptions options;
  options.max_features = 100;
  options.tile_columns = 4;
  options.tile_rows = 3;
  BothTrackers both(test::small_lens(), options);
  test::View last;
  for (int i = 0; i < 25; ++i) {
    test::View view;
    view.q_WC = so3_exp(Vec3(0.01 * i, -0.02 * std::sin(0.5 * i), 0.02 * i));
    view.p_WC = Vec3(0.012 * i, 0.03 * std::sin(0.4 * i), 0.01 * i);
    const MotionPrediction motion{i > 0, view.q_WC.conjugate() * last.q_WC};
    const test::Picture picture = paint(wall, camera, view, 1.0 - 0.01 * i);
    both.track(picture.view, motion);
    last = view;
  }
  EXPECT_GT(both.flown_score.kept, 1500U);
  both.expect_no_worse();
}

TEST(TrackerComparison, KeepsAsManyTracksOverEuroc) {
  const auto folder = test::data_folder("euroc_mh01");
  if (!folder) GTEST_SKIP() << test::kNoData;
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(*folder / "mav0/cam0/data")) {
    files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  constexpr std::size_t kImages = 300;
  ASSERT_GE(files.size(), kImages);
  files.resize(kImages);
  BothTrackers both(test::euroc_lens(), TrackerOptions{});
  for (const std::filesystem::path& file : files) {
    const cv::Mat image = cv::imread(file.string(), cv::IMREAD_GRAYSCALE);
    both.track({image.data, image.cols, image.rows, static_cast<std::int32_t>(image.step)}, MotionPrediction{});
  }
  both.expect_no_worse();
}

}  // namespace
}  // namespace plumb
