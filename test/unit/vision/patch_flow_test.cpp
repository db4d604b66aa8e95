// The flow of patches against the truth of a painted wall and against OpenCV's.

#include "fsw/vision/patch_flow.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <opencv2/video/tracking.hpp>
#include <vector>

#include "fsw/vision/flight_kernels.h"
#include "test/unit/vision/painted_scene.h"

namespace plumb {
namespace {

using test::Picture;
using test::View;
using Kernels = FlightKernels<320, 240>;

/// A camera that turns, shifts and comes nearer, its image and where it then sees a pixel of the first image.
struct TwoViews {
  CameraModel camera{test::small_lens()};
  View first;
  View second;
  Picture image_1;
  Picture image_2;

  explicit TwoViews(test::Generator& g) {
    const test::PaintedWall wall(g);
    second.q_WC = so3_exp(g.normal_vector<3>(0.01));
    second.p_WC = g.normal_vector<3>(0.01);
    image_1 = paint(wall, camera, first);
    image_2 = paint(wall, camera, second);
  }
  Vec2 moved(const Vec2& pixel) const {
    Vec2 normalised;
    Vec2 out;
    EXPECT_EQ(camera.undistort(pixel, normalised), Status::kOk);
    EXPECT_EQ(camera.distort(seen_at(second, on_wall(first, normalised)), out), Status::kOk);
    return out;
  }
};

std::vector<FlowPoint> random_points(test::Generator& g, int count) {
  std::vector<FlowPoint> points;
  for (int i = 0; i < count; ++i) {
    const auto u = static_cast<float>(g.uniform(4.0, 315.0));
    const auto v = static_cast<float>(g.uniform(4.0, 235.0));
    points.push_back({u, v, u + static_cast<float>(g.normal(1.0)), v + static_cast<float>(g.normal(1.0))});
  }
  return points;
}

/// The same question put to OpenCV.
std::vector<FlowPoint> by_opencv(const ImageView& from, const ImageView& to, std::vector<FlowPoint> points,
                                 const TrackerOptions& options) {
  const auto matrix = [](const ImageView& view) {
    return cv::Mat(view.height, view.width, CV_8UC1, const_cast<std::uint8_t*>(view.pixels),
                   static_cast<std::size_t>(view.stride));
  };
  std::vector<cv::Point2f> start;
  std::vector<cv::Point2f> end;
  for (const FlowPoint& point : points) {
    start.emplace_back(point.from_u_px, point.from_v_px);
    end.emplace_back(point.to_u_px, point.to_v_px);
  }
  std::vector<std::uint8_t> status;
  std::vector<float> error;
  cv::calcOpticalFlowPyrLK(
      matrix(from), matrix(to), start, end, status, error, cv::Size(options.window_px, options.window_px),
      options.levels - 1,
      cv::TermCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, options.max_iterations, options.epsilon_px),
      cv::OPTFLOW_USE_INITIAL_FLOW, options.min_eigenvalue);
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i].to_u_px = end[i].x;
    points[i].to_v_px = end[i].y;
    points[i].residual = error[i];
    points[i].found = status[i] != 0;
  }
  return points;
}

// Noise of black and white pixels has the largest differences and gradients there are.
TEST(PatchFlow, AnExtremeImageMovesNothingEither) {
  test::Generator g(test::base_seed());
  std::vector<std::uint8_t> pixels(320 * 240);
  for (std::uint8_t& pixel : pixels) pixel = g.integer(0, 1) == 0 ? 0 : 255;
  const ImageView noise{pixels.data(), 320, 240, 320};
  for (const std::int32_t window_px : {5, 13, 21}) {
    for (const bool light_change : {false, true}) {
      TrackerOptions options;
      options.window_px = window_px;
      options.light_change = light_change;
      const auto kernels = std::make_unique<Kernels>(test::small_lens(), options);
      kernels->push(noise);
      kernels->push(noise);
      std::vector<FlowPoint> points = random_points(g, 100);
      for (FlowPoint& point : points) {
        point.to_u_px = point.from_u_px;
        point.to_v_px = point.from_v_px;
      }
      kernels->follow(points);
      for (const FlowPoint& point : points) {
        if (!point.found) continue;
        EXPECT_EQ(point.to_u_px, point.from_u_px);
        EXPECT_EQ(point.to_v_px, point.from_v_px);
      }
    }
  }
}

TEST(PatchFlow, FindsWhatOpenCvFindsTo005Pixels) {
  std::size_t both = 0;
  std::size_t apart = 0;
  std::size_t lost = 0;
  std::size_t lost_by_opencv = 0;
  test::for_all(8, [&](test::Generator& g) {
    const TwoViews views(g);
    TrackerOptions options;
    options.window_px = 2 * static_cast<std::int32_t>(g.integer(2, 10)) + 1;
    options.light_change = false;  // of which OpenCV's knows nothing
    const auto kernels = std::make_unique<Kernels>(test::small_lens(), options);
    kernels->push(views.image_1.view);
    kernels->push(views.image_2.view);
    const std::vector<FlowPoint> asked = random_points(g, 150);
    std::vector<FlowPoint> found = asked;
    kernels->follow(found);
    const std::vector<FlowPoint> expected = by_opencv(views.image_1.view, views.image_2.view, asked, options);
    for (std::size_t i = 0; i < asked.size(); ++i) {
      if (!found[i].found) ++lost;
      if (!expected[i].found) ++lost_by_opencv;
      if (!found[i].found || !expected[i].found) continue;
      ++both;
      const float distance_px =
          std::hypot(found[i].to_u_px - expected[i].to_u_px, found[i].to_v_px - expected[i].to_v_px);
      if (distance_px > 0.05F) {
        ++apart;  // one of the two converged elsewhere, or not at all
      } else {
        EXPECT_NEAR(found[i].residual, expected[i].residual, 0.3F);
      }
    }
  });
  EXPECT_GT(both, 1000U);
  EXPECT_LT(static_cast<double>(apart), 0.02 * static_cast<double>(both)) << apart << " of " << both;
  EXPECT_LE(lost, lost_by_opencv + 2U);
}

/// The picture in another light.
Picture lit(const Picture& picture, double gain, double offset) {
  Picture out = picture;
  for (std::uint8_t& grey : out.pixels) {
    grey = static_cast<std::uint8_t>(std::clamp(std::round(gain * grey + offset), 0.0, 255.0));
  }
  out.view.pixels = out.pixels.data();
  return out;
}

std::vector<FlowPoint> followed(const TrackerOptions& options, const Picture& from, const Picture& to,
                                std::vector<FlowPoint> points) {
  const auto kernels = std::make_unique<Kernels>(test::small_lens(), options);
  kernels->push(from.view);
  kernels->push(to.view);
  kernels->follow(points);
  return points;
}

/// Of the points found by both, how many are further apart than 0.05 px.
double share_apart(const std::vector<FlowPoint>& a, const std::vector<FlowPoint>& b) {
  int both = 0;
  int apart = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (!a[i].found || !b[i].found) continue;
    ++both;
    if (std::hypot(a[i].to_u_px - b[i].to_u_px, a[i].to_v_px - b[i].to_v_px) > 0.05F) ++apart;
  }
  EXPECT_GT(2 * static_cast<std::size_t>(both), a.size());
  return static_cast<double>(apart) / both;
}

TEST(PatchFlow, FollowsThroughAChangeOfLight) {
  test::for_all(8, [](test::Generator& g) {
    const TwoViews views(g);
    const double gain = g.uniform(0.6, 0.9);
    const double offset = g.uniform(0.0, 25.0);
    const bool brightens = g.integer(0, 1) == 1;
    const Picture first = brightens ? lit(views.image_1, gain, offset) : views.image_1;
    const Picture second = brightens ? views.image_2 : lit(views.image_2, gain, offset);
    const std::vector<FlowPoint> asked = random_points(g, 150);
    TrackerOptions options;
    options.window_px = 2 * static_cast<std::int32_t>(g.integer(6, 10)) + 1;
    const std::vector<FlowPoint> same = followed(options, views.image_1, views.image_2, asked);
    const std::vector<FlowPoint> changed = followed(options, first, second, asked);
    EXPECT_LT(share_apart(same, changed), 0.2);
    for (std::size_t i = 0; i < asked.size(); ++i) {
      if (!same[i].found || !changed[i].found || same[i].residual > 10.0F) continue;
      EXPECT_LT(changed[i].residual, same[i].residual + 3.0F);
    }
    options.light_change = false;
    const std::vector<FlowPoint> misled = followed(options, first, second, asked);
    EXPECT_GT(share_apart(followed(options, views.image_1, views.image_2, asked), misled), 0.3);
  });
}

// As far as a patch that only shifts can follow one that also turns and grows.
TEST(PatchFlow, FindsTheTruth) {
  test::for_all(4, [](test::Generator& g) {
    const TwoViews views(g);
    const auto kernels = std::make_unique<Kernels>(test::small_lens(), TrackerOptions{});
    kernels->push(views.image_1.view);
    kernels->push(views.image_2.view);
    std::vector<double> misses_px;
    std::vector<FlowPoint> points = random_points(g, 150);
    kernels->follow(points);
    for (const FlowPoint& point : points) {
      const Vec2 truth = views.moved(Vec2(static_cast<double>(point.from_u_px), static_cast<double>(point.from_v_px)));
      const bool in_view = truth.x() > 10.0 && truth.x() < 310.0 && truth.y() > 10.0 && truth.y() < 230.0;
      if (!in_view || !point.found) continue;
      misses_px.push_back(
          (truth - Vec2(static_cast<double>(point.to_u_px), static_cast<double>(point.to_v_px))).norm());
    }
    ASSERT_GT(misses_px.size(), 100U);
    std::sort(misses_px.begin(), misses_px.end());
    EXPECT_LT(misses_px[misses_px.size() / 2], 0.1);
    EXPECT_LT(misses_px[misses_px.size() * 9 / 10], 0.3);
  });
}

TEST(PatchFlow, AnImageAgainstItselfMovesNothing) {
  test::Generator g(test::base_seed());
  const TwoViews views(g);
  const auto kernels = std::make_unique<Kernels>(test::small_lens(), TrackerOptions{});
  kernels->push(views.image_1.view);
  kernels->push(views.image_1.view);
  std::vector<FlowPoint> points = random_points(g, 100);
  for (FlowPoint& point : points) {
    point.to_u_px = point.from_u_px;
    point.to_v_px = point.from_v_px;
  }
  kernels->follow(points);
  for (const FlowPoint& point : points) {
    ASSERT_TRUE(point.found);
    EXPECT_EQ(point.to_u_px, point.from_u_px);
    EXPECT_EQ(point.to_v_px, point.from_v_px);
    EXPECT_EQ(point.residual, 0.0F);
  }
}

TEST(PatchFlow, FindsNothingWithoutTextureAnImageOrAFiniteGuess) {
  const std::vector<std::uint8_t> grey(320 * 240, 90);
  const ImageView blank{grey.data(), 320, 240, 320};
  const auto kernels = std::make_unique<Kernels>(test::small_lens(), TrackerOptions{});
  const auto found = [&kernels](const FlowPoint& asked) {
    std::vector<FlowPoint> points = {asked};
    points.front().found = true;
    kernels->follow(points);
    return points.front().found;
  };
  const FlowPoint middle{100.0F, 100.0F, 101.0F, 100.0F};
  kernels->push(blank);
  EXPECT_FALSE(found(middle)) << "one image";
  kernels->push(blank);
  EXPECT_FALSE(found(middle)) << "no texture";

  test::Generator g(test::base_seed());
  const TwoViews views(g);
  kernels->push(views.image_1.view);
  kernels->push(views.image_2.view);
  EXPECT_TRUE(found(middle));
  constexpr float kNotANumber = std::numeric_limits<float>::quiet_NaN();
  constexpr float kFar = 1e30F;
  for (const float bad : {kNotANumber, kFar, -kFar}) {
    EXPECT_FALSE(found({bad, 100.0F, 100.0F, 100.0F}));
    EXPECT_FALSE(found({100.0F, 100.0F, 100.0F, bad}));
  }
  kernels->forget();
  EXPECT_FALSE(found(middle)) << "forgotten";
}

}  // namespace
}  // namespace plumb
