#include "fsw/vision/patch_template.h"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "test/unit/vision/painted_scene.h"

namespace plumb {
namespace {

using test::Picture;
using test::View;

CameraModel small_camera() {
  CameraCalibration lens = test::small_lens();
  lens.distortion = Distortion::kNone;
  return CameraModel(lens);
}

TEST(PatchTemplate, FindsAShiftToATenthOfAPixel) {
  test::for_all(5, [](test::Generator& g) {
    const CameraModel camera = small_camera();
    const test::PaintedWall wall(g);
    const View first;
    View second;
    second.p_WC = Vec3(g.uniform(-0.005, 0.005), g.uniform(-0.005, 0.005), 0.0);  // up to 1.5 px
    const Picture before = paint(wall, camera, first);
    const Picture after = paint(wall, camera, second, 0.8);  // a shorter exposure as well
    int aligned = 0;
    for (int i = 0; i < 50; ++i) {
      const Vec2 start(g.uniform(30.0, 290.0), g.uniform(30.0, 210.0));
      PatchTemplate patch;
      if (!ok(patch.capture(before.view, static_cast<float>(start.x()), static_cast<float>(start.y())))) continue;
      PatchPosition position{static_cast<float>(start.x()), static_cast<float>(start.y())};
      if (!ok(patch.align(after.view, Mat2::Identity(), position)) || position.similarity < 0.95F) continue;
      ++aligned;
      const Vec2 truth =
          start - Vec2(second.p_WC.x() * camera.calibration().fx, second.p_WC.y() * camera.calibration().fy);
      EXPECT_NEAR(static_cast<double>(position.u_px), truth.x(), 0.1);
      EXPECT_NEAR(static_cast<double>(position.v_px), truth.y(), 0.1);
    }
    EXPECT_GT(aligned, 35);
  });
}

TEST(PatchTemplate, FollowsAWarp) {
  test::Generator g(test::base_seed());
  const CameraModel camera = small_camera();
  const test::PaintedWall wall(g);
  const View first;
  View second;
  second.q_WC = so3_exp(Vec3(0.0, 0.0, 0.6));  // far more than a patch bears without the warp
  const Picture before = paint(wall, camera, first);
  const Picture after = paint(wall, camera, second);
  const Mat2 turn = second.q_WC.conjugate().toRotationMatrix().topLeftCorner<2, 2>();
  int aligned = 0;
  for (int i = 0; i < 50; ++i) {
    const Vec2 start(g.uniform(120.0, 200.0), g.uniform(80.0, 160.0));
    PatchTemplate patch;
    if (!ok(patch.capture(before.view, static_cast<float>(start.x()), static_cast<float>(start.y())))) continue;
    Vec2 normalised;
    Vec2 truth;
    ASSERT_EQ(camera.undistort(start, normalised), Status::kOk);
    ASSERT_EQ(camera.distort(seen_at(second, on_wall(first, normalised)), truth), Status::kOk);
    PatchPosition position{static_cast<float>(truth.x() + 0.5), static_cast<float>(truth.y() - 0.5)};
    if (!ok(patch.align(after.view, turn, position))) continue;
    ++aligned;
    EXPECT_NEAR(static_cast<double>(position.u_px), truth.x(), 0.1);
    EXPECT_NEAR(static_cast<double>(position.v_px), truth.y(), 0.1);
    EXPECT_GT(position.similarity, 0.98F);
  }
  EXPECT_GT(aligned, 35);
}

TEST(PatchTemplate, RefusesFlatPatchesAndTheEdgeOfTheImage) {
  std::vector<std::uint8_t> grey(64 * 64, 100);
  const ImageView flat{grey.data(), 64, 64, 64};
  PatchTemplate patch;
  EXPECT_EQ(patch.capture(flat, 32.0F, 32.0F), Status::kIllConditioned);
  EXPECT_EQ(patch.capture(flat, 6.0F, 32.0F), Status::kRejected);
  EXPECT_EQ(patch.capture(flat, 32.0F, 57.0F), Status::kRejected);
  EXPECT_EQ(patch.capture(flat, std::numeric_limits<float>::quiet_NaN(), 32.0F), Status::kRejected);
  for (int row = 0; row < 64; ++row) {
    for (int column = 32; column < 64; ++column) grey[static_cast<std::size_t>(row * 64 + column)] = 200;
  }
  EXPECT_EQ(patch.capture(flat, 32.0F, 32.0F), Status::kIllConditioned);  // an edge: nothing to hold along it
}

TEST(PatchTemplate, RefusesToLeaveTheImageOrToMatchNothing) {
  test::Generator g(test::base_seed());
  const CameraModel camera = small_camera();
  const Picture picture = paint(test::PaintedWall(g), camera, View{});
  PatchTemplate patch;
  bool captured = false;
  for (float u = 40.0F; u < 200.0F && !captured; u += 5.0F) captured = ok(patch.capture(picture.view, u, 100.0F));
  ASSERT_TRUE(captured);
  PatchPosition outside{2.0F, 100.0F};
  EXPECT_EQ(patch.align(picture.view, Mat2::Identity(), outside), Status::kRejected);
  PatchPosition nowhere{std::numeric_limits<float>::quiet_NaN(), 100.0F};
  EXPECT_EQ(patch.align(picture.view, Mat2::Identity(), nowhere), Status::kRejected);
  const std::vector<std::uint8_t> grey(320 * 240, 50);
  PatchPosition middle{160.0F, 120.0F};
  EXPECT_EQ(patch.align({grey.data(), 320, 240, 320}, Mat2::Identity(), middle), Status::kIllConditioned);
}

}  // namespace
}  // namespace plumb
