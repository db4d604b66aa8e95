#pragma once
// A flight over a textured plane, simple enough to be computed while it is flown: two seconds of rest, then swings on
// every axis and in heading, a camera and a range finder that look straight down. Time is on any clock; `t_start_s` is
// its zero.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

namespace plumb::test {

class PlaneFlight {
 public:
  static constexpr int kWidth = 320;   // px
  static constexpr int kHeight = 240;  // px
  static constexpr double kFocal_px = 250.0;
  static constexpr double kRest_s = 2.0;
  static constexpr double kGravity_m_s2 = 9.80665;

  explicit PlaneFlight(double t_start_s) : t_start_s_(t_start_s) {}

  // The body in W, which has its origin where the body rests and its heading then: ahead, aside, up.
  std::array<double, 3> position_m(double t_s) const {
    return {swing(t_s, kAhead), swing(t_s, kAside), swing(t_s, kUp)};
  }
  std::array<double, 3> velocity_m_s(double t_s) const {
    return {swing_rate(t_s, kAhead), swing_rate(t_s, kAside), swing_rate(t_s, kUp)};
  }
  double heading_rad(double t_s) const { return swing(t_s, kTurn); }
  /// Height above the plane, which is what a range finder beside the camera measures.
  double height_m(double t_s) const { return kHeight_m + swing(t_s, kUp); }
  std::array<double, 3> rate_rad_s(double t_s) const { return {0.0, 0.0, swing_rate(t_s, kTurn)}; }
  /// Specific force in the body, which is turned by the heading alone.
  std::array<double, 3> force_m_s2(double t_s) const {
    const double heading = swing(t_s, kTurn);
    const double c = std::cos(heading);
    const double s = std::sin(heading);
    const double ax = swing_acceleration(t_s, kAhead);
    const double ay = swing_acceleration(t_s, kAside);
    return {c * ax + s * ay, -s * ax + c * ay, kGravity_m_s2 + swing_acceleration(t_s, kUp)};
  }

  /// What the camera sees: x to the right is the body's x, y down its negative y.
  std::vector<std::uint8_t> image(double t_s) const {
    const double heading = swing(t_s, kTurn);
    const double scale = height_m(t_s) / kFocal_px;
    const double c = scale * std::cos(heading);
    const double s = scale * std::sin(heading);
    const double x0 = swing(t_s, kAhead);
    const double y0 = swing(t_s, kAside);
    auto n = static_cast<std::uint32_t>(std::llround(1e3 * t_s));
    std::vector<std::uint8_t> pixels;
    pixels.reserve(static_cast<std::size_t>(kWidth) * kHeight);
    for (int v = 0; v < kHeight; ++v) {
      const double y = -(v - 0.5 * (kHeight - 1));
      for (int u = 0; u < kWidth; ++u) {
        const double x = u - 0.5 * (kWidth - 1);
        const unsigned noise = (n = n * 1664525U + 1013904223U) >> 31U;  // no two images of a sensor are equal
        pixels.push_back(static_cast<std::uint8_t>(ground(x0 + c * x - s * y, y0 + s * x + c * y) + noise));
      }
    }
    return pixels;
  }

 private:
  struct Swing {
    double size;
    double rate_rad_s;
  };
  static constexpr double kHeight_m = 5.0;
  static constexpr Swing kAhead{1.2, 0.8};
  static constexpr Swing kAside{0.8, 0.6};
  static constexpr Swing kUp{0.4, 0.7};
  static constexpr Swing kTurn{0.2, 0.5};

  double since(double t_s) const { return std::max(0.0, t_s - t_start_s_ - kRest_s); }
  double swing(double t_s, Swing w) const { return w.size * (1.0 - std::cos(w.rate_rad_s * since(t_s))); }
  double swing_rate(double t_s, Swing w) const { return w.size * w.rate_rad_s * std::sin(w.rate_rad_s * since(t_s)); }
  double swing_acceleration(double t_s, Swing w) const {
    if (since(t_s) <= 0.0) return 0.0;
    return w.size * w.rate_rad_s * w.rate_rad_s * std::cos(w.rate_rad_s * since(t_s));
  }

  // Grey values at the corners of two grids, interpolated between them.
  static std::uint8_t ground(double x_m, double y_m) {
    return static_cast<std::uint8_t>(30.0 + 120.0 * noise(x_m / 0.16, y_m / 0.16, 1) +
                                     75.0 * noise(x_m / 0.5, y_m / 0.5, 2));
  }
  static double noise(double x, double y, std::uint32_t grid) {
    const double left = std::floor(x);
    const double low = std::floor(y);
    const double fx = x - left;
    const double fy = y - low;
    const auto i = static_cast<std::int32_t>(left);
    const auto k = static_cast<std::int32_t>(low);
    return (1 - fy) * ((1 - fx) * corner(i, k, grid) + fx * corner(i + 1, k, grid)) +
           fy * ((1 - fx) * corner(i, k + 1, grid) + fx * corner(i + 1, k + 1, grid));
  }
  static double corner(std::int32_t i, std::int32_t k, std::uint32_t grid) {
    std::uint32_t h = static_cast<std::uint32_t>(i) * 0x9E3779B1U ^ static_cast<std::uint32_t>(k) * 0x85EBCA77U ^ grid;
    h = (h ^ h >> 15U) * 0x2C1B3C6DU;
    h = (h ^ h >> 12U) * 0x297A2D39U;
    return static_cast<double>((h ^ h >> 15U) & 0xFFFFU) / 65535.0;
  }

  double t_start_s_;
};

}  // namespace plumb::test
