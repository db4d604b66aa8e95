// Corners and scores against OpenCV's.

#include "fsw/vision/fast_corners.h"

#include <gtest/gtest.h>

#include <memory>
#include <opencv2/features2d.hpp>
#include <vector>

#include "fsw/vision/image_pyramid.h"
#include "test/unit/vision/textures.h"

namespace plumb {
namespace {

constexpr int kWidth = 320;
constexpr int kHeight = 120;
constexpr int kRadius_px = 3;
using Pyramid = ImagePyramid<kWidth, kHeight, 1>;

/// The corners inside the rectangle by OpenCV, which finds none in the outer 3 px of what it is given.
std::vector<cv::KeyPoint> corners_by_opencv(const cv::Mat& image, const TileRect& rect, int threshold) {
  const cv::Rect region(rect.left - kRadius_px, rect.top - kRadius_px, rect.right - rect.left + 2 * kRadius_px,
                        rect.bottom - rect.top + 2 * kRadius_px);
  std::vector<cv::KeyPoint> corners;
  cv::FAST(image(region), corners, threshold, true);
  return corners;
}

TileRect random_rect(test::Generator& g) {
  TileRect rect;
  rect.left = static_cast<std::int32_t>(g.integer(kRadius_px, kWidth - kRadius_px - 2));
  rect.right = static_cast<std::int32_t>(g.integer(rect.left + 1, kWidth - kRadius_px));
  rect.top = static_cast<std::int32_t>(g.integer(kRadius_px, kHeight - kRadius_px - 2));
  rect.bottom = static_cast<std::int32_t>(g.integer(rect.top + 1, kHeight - kRadius_px));
  return rect;
}

TEST(FastCorners, AreThoseOfOpenCv) {
  const auto pyramid = std::make_unique<Pyramid>();
  const auto mask = std::make_unique<SpacingMask>(kWidth, kHeight, 0);
  std::size_t found = 0;
  test::for_all(200, [&](test::Generator& g) {
    const cv::Mat image = test::random_texture(g, kWidth, kHeight);
    pyramid->build(test::view_of(image), 1, 1);
    const TileRect rect = random_rect(g);
    const auto threshold = static_cast<std::int32_t>(g.integer(0, 3) == 0 ? g.integer(1, 255) : g.integer(1, 40));
    BestCorners<kCornersPerTile> best;
    CornerSink sink(*mask, best);
    detect_fast_corners(pyramid->level(0), rect, threshold, sink);

    BestCorners<kCornersPerTile> expected;
    const std::vector<cv::KeyPoint> corners = corners_by_opencv(image, rect, threshold);
    for (const cv::KeyPoint& corner : corners) {
      expected.offer({corner.pt.x + static_cast<float>(rect.left - kRadius_px),
                      corner.pt.y + static_cast<float>(rect.top - kRadius_px), corner.response});
    }
    ASSERT_EQ(static_cast<std::size_t>(sink.offered()), corners.size());
    ASSERT_EQ(best.size(), expected.size());
    for (std::size_t i = 0; i < best.size(); ++i) {
      EXPECT_EQ(best[i].u_px, expected[i].u_px);
      EXPECT_EQ(best[i].v_px, expected[i].v_px);
      EXPECT_EQ(best[i].score, expected[i].score);
    }
    found += corners.size();
  });
  EXPECT_GT(found, 10'000U);
}

TEST(FastCorners, ADotIsOneAndAStraightEdgeIsNone) {
  cv::Mat image(kHeight, kWidth, CV_8UC1, cv::Scalar(40));
  image.at<std::uint8_t>(50, 70) = 200;
  image.colRange(200, kWidth).setTo(250);
  const auto pyramid = std::make_unique<Pyramid>();
  pyramid->build(test::view_of(image), 1, 1);
  const auto mask = std::make_unique<SpacingMask>(kWidth, kHeight, 0);
  BestCorners<kCornersPerTile> best;
  CornerSink sink(*mask, best);
  detect_fast_corners(pyramid->level(0), {10, 10, kWidth - 10, kHeight - 10}, 100, sink);
  ASSERT_EQ(sink.offered(), 1);
  EXPECT_EQ(best[0].u_px, 70.0F);
  EXPECT_EQ(best[0].v_px, 50.0F);
  EXPECT_EQ(best[0].score, 159.0F);  // at 159 all of the circle is darker by more, at 160 it is not
}

}  // namespace
}  // namespace plumb
