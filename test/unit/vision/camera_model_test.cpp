#include "fsw/vision/camera_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "test/support/property.h"
#include "test/unit/vision/lenses.h"

namespace plumb {
namespace {

constexpr double kNotANumber = std::numeric_limits<double>::quiet_NaN();

struct Lens {
  const char* name;
  CameraCalibration calibration;
};
// For the names of the tests, which would otherwise hold the bytes of the struct.
void PrintTo(const Lens& lens, std::ostream* out) { *out << lens.name; }

class EveryLens : public ::testing::TestWithParam<Lens> {
 protected:
  const CameraCalibration& calibration() const { return GetParam().calibration; }
  CameraModel model() const { return CameraModel(calibration()); }
};

TEST_P(EveryLens, IsAccepted) { EXPECT_EQ(CameraModel::check(calibration()), Status::kOk); }

TEST_P(EveryLens, UndistortAndDistortReturnToTheSamePixelOverTheWholeImage) {
  const CameraModel camera = model();
  constexpr int kStep_px = 7;
  for (int v = 0; v < calibration().height; v += kStep_px) {
    for (int u = 0; u < calibration().width; u += kStep_px) {
      const Vec2 pixel(u, v);
      Vec2 normalised;
      Vec2 back;
      ASSERT_EQ(camera.undistort(pixel, normalised), Status::kOk) << u << ' ' << v;
      ASSERT_EQ(camera.distort(normalised, back), Status::kOk) << u << ' ' << v;
      ASSERT_LT((back - pixel).norm(), 1e-8) << u << ' ' << v;
    }
  }
}

TEST_P(EveryLens, JacobianIsTheDerivative) {
  const CameraModel camera = model();
  test::for_all(500, [&](test::Generator& g) {
    const Vec2 n(g.uniform(-0.8, 0.8), g.uniform(-0.5, 0.5));
    Vec2 pixel;
    Mat2 analytic;
    ASSERT_EQ(camera.distort(n, pixel, analytic), Status::kOk);
    constexpr double kStep = 1e-6;
    for (int axis = 0; axis < 2; ++axis) {
      Vec2 ahead;
      Vec2 behind;
      ASSERT_EQ(camera.distort(n + kStep * Vec2::Unit(axis), ahead), Status::kOk);
      ASSERT_EQ(camera.distort(n - kStep * Vec2::Unit(axis), behind), Status::kOk);
      EXPECT_LT(((ahead - behind) / (2.0 * kStep) - analytic.col(axis)).norm(), 1e-5) << n.transpose();
    }
  });
}

// The factor of a lens and its inverse must run through the centre without a step (reference fault F17): the ratio of
// pixel offset to normalised offset is the same at every scale of small offsets.
TEST_P(EveryLens, IsContinuousAtTheCentre) {
  const CameraModel camera = model();
  Vec2 centre;
  Mat2 slope;
  ASSERT_EQ(camera.distort(Vec2::Zero(), centre, slope), Status::kOk);
  EXPECT_EQ(centre, Vec2(calibration().cx, calibration().cy));
  for (double r = 1e-9; r < 2e-2; r *= 1.25) {
    const Vec2 n(0.6 * r, 0.8 * r);
    Vec2 pixel;
    Vec2 back;
    ASSERT_EQ(camera.distort(n, pixel), Status::kOk);
    EXPECT_LT((pixel - centre - slope * n).norm(), 1e-10 + calibration().fx * 2.0 * r * r) << r;
    ASSERT_EQ(camera.undistort(pixel, back), Status::kOk);
    EXPECT_LT((back - n).norm(), 1e-14 + 1e-12 * r) << r;
  }
}

TEST_P(EveryLens, RefusesWhatIsNotANumber) {
  const CameraModel camera = model();
  Vec2 out;
  EXPECT_EQ(camera.distort(Vec2(kNotANumber, 0.0), out), Status::kInvalidValue);
  EXPECT_EQ(camera.undistort(Vec2(0.0, kNotANumber), out), Status::kInvalidValue);
  EXPECT_EQ(camera.undistort(Vec2(std::numeric_limits<double>::infinity(), 0.0), out), Status::kInvalidValue);
}

INSTANTIATE_TEST_SUITE_P(CameraModel, EveryLens,
                         ::testing::Values(Lens{"None", test::no_lens()}, Lens{"RadialTangential", test::euroc_lens()},
                                           Lens{"Equidistant", test::fisheye_lens()}, Lens{"Fov", test::fov_lens()}),
                         [](const ::testing::TestParamInfo<Lens>& lens) { return std::string(lens.param.name); });

TEST(CameraModel, FovFactorAtTheCentreIsTheTrueLimit) {
  const CameraCalibration lens = test::fov_lens();
  const double w = lens.coefficients[0];
  Vec2 normalised;
  ASSERT_EQ(CameraModel(lens).undistort(Vec2(lens.cx + 1e-6 * lens.fx, lens.cy), normalised), Status::kOk);
  EXPECT_NEAR(normalised.x() / 1e-6, w / (2.0 * std::tan(0.5 * w)), 1e-9);
}

TEST(CameraModel, EquidistantSeesTheAngle) {
  CameraCalibration lens = test::fisheye_lens();
  lens.coefficients = {};
  Vec2 pixel;
  ASSERT_EQ(CameraModel(lens).distort(Vec2(std::tan(1.2), 0.0), pixel), Status::kOk);
  EXPECT_NEAR(pixel.x(), lens.cx + 1.2 * lens.fx, 1e-9);
}

TEST(CameraModel, RefusesPointsBeyondTheFold) {
  CameraCalibration lens = test::euroc_lens();
  lens.coefficients = {-0.4, 0.0, 0.0, 0.0};  // r (1 - 0.4 r^2) turns round at r = 0.913, where the image ends at 0.609
  const CameraModel camera(lens);
  Vec2 out;
  EXPECT_EQ(camera.distort(Vec2(0.90, 0.0), out), Status::kOk);
  EXPECT_EQ(camera.distort(Vec2(0.92, 0.0), out), Status::kInvalidValue);
  EXPECT_EQ(camera.distort(Vec2(1.50, 0.0), out), Status::kInvalidValue);
  EXPECT_EQ(camera.undistort(Vec2(lens.cx + 0.605 * lens.fx, lens.cy), out), Status::kOk);
  EXPECT_EQ(camera.undistort(Vec2(lens.cx + 0.615 * lens.fx, lens.cy), out), Status::kIllConditioned);
}

TEST(CameraModel, RefusesPointsBeyondTheFirstFoldEvenWhereTheModelGrowsAgain) {
  CameraCalibration lens = test::euroc_lens();
  lens.coefficients = {-0.5, 0.1, 0.0, 0.0};  // falls from r = 1 to r = 1.41 and grows again after that
  Vec2 out;
  EXPECT_EQ(CameraModel(lens).distort(Vec2(0.98, 0.0), out), Status::kOk);
  EXPECT_EQ(CameraModel(lens).distort(Vec2(2.00, 0.0), out), Status::kInvalidValue);
}

TEST(CameraModel, RefusesPixelsThatNoPointMapsTo) {
  const CameraCalibration fov = test::fov_lens();
  Vec2 out;
  EXPECT_EQ(CameraModel(fov).undistort(Vec2(fov.cx + 1.7 * fov.fx, fov.cy), out), Status::kIllConditioned);
  const CameraCalibration fisheye = test::fisheye_lens();
  EXPECT_EQ(CameraModel(fisheye).undistort(Vec2(fisheye.cx + 3.0 * fisheye.fx, fisheye.cy), out),
            Status::kIllConditioned);
}

TEST(CameraModel, RefusesBadCalibrations) {
  const CameraCalibration good = test::euroc_lens();
  const auto refused = [&](auto spoil) {
    CameraCalibration bad = good;
    spoil(bad);
    return CameraModel::check(bad) == Status::kInvalidValue;
  };
  EXPECT_TRUE(refused([](CameraCalibration& c) { c.width = 0; }));
  EXPECT_TRUE(refused([](CameraCalibration& c) { c.height = -480; }));
  EXPECT_TRUE(refused([](CameraCalibration& c) { c.fx = 0.0; }));
  EXPECT_TRUE(refused([](CameraCalibration& c) { c.fy = -457.0; }));
  EXPECT_TRUE(refused([](CameraCalibration& c) { c.fx = kNotANumber; }));
  EXPECT_TRUE(refused([](CameraCalibration& c) { c.cx = kNotANumber; }));
  EXPECT_TRUE(refused([](CameraCalibration& c) { c.cy = std::numeric_limits<double>::infinity(); }));
  EXPECT_TRUE(refused([](CameraCalibration& c) { c.coefficients[3] = kNotANumber; }));
  EXPECT_TRUE(refused([](CameraCalibration& c) { c.distortion = static_cast<Distortion>(17); }));
  EXPECT_TRUE(refused([](CameraCalibration& c) {
    c.distortion = Distortion::kFov;  // k1 < 0 is no field of view
  }));
}

}  // namespace
}  // namespace plumb
