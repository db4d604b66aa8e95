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

/// The patches of these tests lie anywhere and not on corners, and a few of them have little to hold on to.
struct Tally {
  int aligned = 0;
  int exact = 0;

  void add(const PatchPosition& position, const Vec2& truth) {
    const double error_px =
        (Vec2(static_cast<double>(position.u_px), static_cast<double>(position.v_px)) - truth).norm();
    EXPECT_LT(error_px, 0.7);
    ++aligned;
    if (error_px < 0.1) ++exact;
  }
  void expect_exact() const {
    EXPECT_GT(aligned, 25);
    EXPECT_GE(exact, 0.9 * aligned);
  }
};

TEST(PatchTemplate, FindsAShiftToATenthOfAPixel) {
  test::for_all(5, [](test::Generator& g) {
    const CameraModel camera = small_camera();
    const test::PaintedWall wall(g);
    const View first;
    View second;
    second.p_WC = Vec3(g.uniform(-0.005, 0.005), g.uniform(-0.005, 0.005), 0.0);  // up to 1.5 px
    const Picture before = paint(wall, camera, first);
    const Picture after = paint(wall, camera, second, 0.8);  // a shorter exposure as well
    Tally tally;
    for (int i = 0; i < 50; ++i) {
      const Vec2 start(g.uniform(30.0, 290.0), g.uniform(30.0, 210.0));
      PatchTemplate patch;
      if (!ok(patch.capture(before.view, static_cast<float>(start.x()), static_cast<float>(start.y())))) continue;
      PatchPosition position{static_cast<float>(start.x()), static_cast<float>(start.y())};
      if (!ok(patch.align(after.view, Mat2::Identity(), position)) || position.similarity < 0.95F) continue;
      const Vec2 truth =
          start - Vec2(second.p_WC.x() * camera.calibration().fx, second.p_WC.y() * camera.calibration().fy);
      tally.add(position, truth);
    }
    tally.expect_exact();
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
  Tally tally;
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
    tally.add(position, truth);
    EXPECT_GT(position.similarity, 0.98F);
  }
  tally.expect_exact();
}

TEST(PatchTemplate, FindsHowMuchNearerTheCameraCame) {
  test::Generator g(test::base_seed());
  const CameraModel camera = small_camera();
  const test::PaintedWall wall(g);
  const View first;
  View second;
  second.p_WC = Vec3(0.0, 0.0, 0.15);
  const Picture before = paint(wall, camera, first);
  const Picture after = paint(wall, camera, second);
  Tally tally;
  for (int i = 0; i < 50; ++i) {
    const Vec2 start(g.uniform(100.0, 220.0), g.uniform(70.0, 170.0));
    PatchTemplate patch;
    if (!ok(patch.capture(before.view, static_cast<float>(start.x()), static_cast<float>(start.y())))) continue;
    Vec2 normalised;
    Vec2 truth;
    ASSERT_EQ(camera.undistort(start, normalised), Status::kOk);
    ASSERT_EQ(camera.distort(seen_at(second, on_wall(first, normalised)), truth), Status::kOk);
    PatchPosition position{static_cast<float>(truth.x() - 0.4), static_cast<float>(truth.y() + 0.4), 1.1F};
    if (!ok(patch.align(after.view, Mat2::Identity(), position)) || position.similarity < 0.95F) continue;
    tally.add(position, truth);
    EXPECT_NEAR(position.scale, 1.0F / 0.85F, 0.06F);
  }
  tally.expect_exact();
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
