#pragma once
// Images of a painted wall, known at every real coordinate, as seen by a camera that moves: the true motion of every
// pixel is a formula and not an interpolation.

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "fsw/measurement/samples.h"
#include "fsw/vision/camera_model.h"
#include "test/support/property.h"

namespace plumb::test {

/// The wall z = 1 of the world, painted with waves of many lengths and directions.
class PaintedWall {
 public:
  explicit PaintedWall(Generator& g) {
    for (Wave& wave : waves_) {
      const double length = std::exp(g.uniform(std::log(kShortest), std::log(kLongest)));
      const double direction = g.uniform(0.0, 2.0 * std::numbers::pi);
      wave = {2.0 * std::numbers::pi / length * Vec2(std::cos(direction), std::sin(direction)),
              g.uniform(0.0, 2.0 * std::numbers::pi)};
    }
  }
  /// Grey level at a point of the wall.
  double grey(const Vec2& point) const {
    double sum = 0.0;
    for (const Wave& wave : waves_) sum += std::sin(wave.number.dot(point) + wave.phase);
    return std::fmin(std::fmax(128.0 + kContrast * sum, 0.0), 255.0);
  }

 private:
  static constexpr double kShortest = 0.03;  // on the wall: 9 px at a focal length of 300 px
  static constexpr double kLongest = 0.3;
  static constexpr double kContrast = 14.0;
  struct Wave {
    Vec2 number = Vec2::Zero();
    double phase = 0.0;
  };
  std::array<Wave, 32> waves_;
};

struct View {
  Quat q_WC = Quat::Identity();
  Vec3 p_WC = Vec3::Zero();
};

/// Where a ray of the normalised plane meets the wall.
inline Vec2 on_wall(const View& view, const Vec2& normalised) {
  const Vec3 ray_W = view.q_WC * normalised.homogeneous();
  return (view.p_WC + ray_W * ((1.0 - view.p_WC.z()) / ray_W.z())).head<2>();
}
/// Where a point of the wall is seen.
inline Vec2 seen_at(const View& view, const Vec2& point) {
  const Vec3 p_C = view.q_WC.conjugate() * (Vec3(point.x(), point.y(), 1.0) - view.p_WC);
  return p_C.head<2>() / p_C.z();
}

struct Picture {
  std::vector<std::uint8_t> pixels;
  ImageView view;
};

inline Picture paint(const PaintedWall& wall, const CameraModel& camera, const View& view, double gain = 1.0) {
  const std::int32_t width = camera.calibration().width;
  const std::int32_t height = camera.calibration().height;
  Picture picture;
  picture.pixels.resize(static_cast<std::size_t>(width * height));
  for (std::int32_t v = 0; v < height; ++v) {
    for (std::int32_t u = 0; u < width; ++u) {
      Vec2 normalised = Vec2::Zero();
      const Status status = camera.undistort(Vec2(u, v), normalised);
      const double grey = ok(status) ? gain * wall.grey(on_wall(view, normalised)) : 0.0;
      picture.pixels[static_cast<std::size_t>(v * width + u)] = static_cast<std::uint8_t>(std::fmin(grey, 255.0) + 0.5);
    }
  }
  picture.view = {picture.pixels.data(), width, height, width};
  return picture;
}

/// A small camera, so that painting is quick.
inline CameraCalibration small_lens() {
  return {320, 240, 300.0, 301.0, 159.0, 121.0, Distortion::kRadialTangential, {-0.2, 0.05, 2e-4, -1e-4}};
}

}  // namespace plumb::test
