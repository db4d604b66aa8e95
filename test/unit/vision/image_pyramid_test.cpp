// The pyramid against OpenCV's, pixel by pixel and in the margin, too.

#include "fsw/vision/image_pyramid.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <memory>
#include <opencv2/video/tracking.hpp>
#include <vector>

#include "test/unit/vision/textures.h"

namespace plumb {
namespace {

constexpr std::int32_t kMaxWidth = 200;
constexpr std::int32_t kMaxHeight = 150;
constexpr std::int32_t kMaxLevels = 6;
using Pyramid = ImagePyramid<kMaxWidth, kMaxHeight, kMaxLevels>;

TEST(ImagePyramid, IsThatOfOpenCv) {
  const auto pyramid = std::make_unique<Pyramid>();
  test::for_all(40, [&pyramid](test::Generator& g) {
    const auto width = static_cast<int>(g.integer(20, kMaxWidth));
    const auto height = static_cast<int>(g.integer(20, kMaxHeight));
    const cv::Mat whole = test::random_texture(g, width + 3, height);
    const cv::Mat image = whole.colRange(3, width + 3);  // rows longer than the image
    constexpr int kPatch_px = 13;
    std::vector<cv::Mat> expected;
    cv::buildOpticalFlowPyramid(image.clone(), expected, cv::Size(kPatch_px, kPatch_px), kMaxLevels - 1, false,
                                cv::BORDER_REFLECT_101, cv::BORDER_CONSTANT, false);
    pyramid->build(test::view_of(image), kMaxLevels, kPatch_px);
    ASSERT_EQ(static_cast<std::size_t>(pyramid->size()), expected.size());
    for (std::int32_t i = 0; i < pyramid->size(); ++i) {
      const ImageView level = pyramid->level(i);
      const cv::Mat& other = expected[static_cast<std::size_t>(i)];
      ASSERT_EQ(level.width, other.cols);
      ASSERT_EQ(level.height, other.rows);
      // OpenCV's margin is as wide as the patch, and mirrors a level that is hardly larger than the patch once.
      for (int v = -kPatch_px; v < level.height + kPatch_px; ++v) {
        for (int u = -kPatch_px; u < level.width + kPatch_px; ++u) {
          ASSERT_EQ(level.pixels[v * level.stride + u], other.data[v * static_cast<int>(other.step) + u])
              << "level " << i << " of " << width << " x " << height << " at " << u << ", " << v;
        }
      }
    }
  });
}

TEST(ImagePyramid, MirrorsATinyImageOverTheWholeMargin) {
  const auto pyramid = std::make_unique<Pyramid>();
  const std::vector<std::uint8_t> pixels = {10, 20, 30, 40, 50, 60};  // 3 x 2
  pyramid->build({pixels.data(), 3, 2, 3}, 1, 1);
  const ImageView level = pyramid->level(0);
  for (std::int32_t v = -kImageMargin_px; v < 2 + kImageMargin_px; ++v) {
    for (std::int32_t u = -kImageMargin_px; u < 3 + kImageMargin_px; ++u) {
      const int column = std::abs((u + 400) % 4 < 3 ? (u + 400) % 4 : 4 - (u + 400) % 4);  // 0 1 2 1 0 1 2 1 ...
      const int row = (v + 400) % 2;
      ASSERT_EQ(level.pixels[v * level.stride + u], 10 * (3 * row + column + 1)) << u << ", " << v;
    }
  }
}

TEST(ImagePyramid, KeepsAConstantAndTakesTheLargestImage) {
  const auto pyramid = std::make_unique<Pyramid>();
  const std::vector<std::uint8_t> white(static_cast<std::size_t>(kMaxWidth * kMaxHeight), 255);
  pyramid->build({white.data(), kMaxWidth, kMaxHeight, kMaxWidth}, kMaxLevels, 1);
  ASSERT_EQ(pyramid->size(), kMaxLevels);
  for (std::int32_t i = 0; i < kMaxLevels; ++i) {
    const ImageView level = pyramid->level(i);
    for (std::int32_t v = 0; v < level.height; ++v) {
      for (std::int32_t u = 0; u < level.width; ++u) ASSERT_EQ(level.pixels[v * level.stride + u], 255);
    }
  }
}

}  // namespace
}  // namespace plumb
