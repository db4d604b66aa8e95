#pragma once
// Which part of the image needs a new feature of the state most: features are spread over tiles, and as many as wanted
// are put where the laser's spot is, so that the facet under the beam is small (what the paper names as future work).

#include <algorithm>
#include <array>
#include <cstdint>

#include "fsw/base/assert.h"
#include "fsw/estimator/options.h"

namespace plumb {

class FeatureSpread {
 public:
  FeatureSpread(const VisionOptions& options, const SensorCalibration& calibration) : calibration_(calibration) {
    use(options);
  }
  /// Other options from the next clear() on.
  void use(const VisionOptions& options) {
    PLUMB_ASSERT(static_cast<std::size_t>(options.tiles_x * options.tiles_y) <= kMaxTiles);
    options_ = options;
  }

  /// No features. `depth_m`: where the beam is about to end.
  void clear(double depth_m) {
    tiles_.fill(0);
    at_spot_ = 0;
    spot_ = calibration_.impact_C_m(depth_m / calibration_.u_C.z()).hnormalized();
  }
  /// A feature in the state, at z in the normalised plane.
  void add(const Vec2& z) {
    ++tiles_[tile_of(z)];
    at_spot_ += near_spot(z) ? 1 : 0;
  }
  /// How crowded it is at z: the new feature goes where it is least.
  std::uint32_t crowd(const Vec2& z) const {
    if (at_spot_ < options_.spot_features && near_spot(z)) return 0;
    return 1 + tiles_[tile_of(z)];
  }

 private:
  static constexpr std::size_t kMaxTiles = 64;
  static constexpr double kSpotRadius = 0.2;  // in the normalised plane

  bool near_spot(const Vec2& z) const { return (z - spot_).norm() < kSpotRadius; }
  std::size_t tile_of(const Vec2& z) const {
    const auto index = [](double value, double half, int tiles) {
      const double scaled = (value / half + 1.0) * 0.5 * tiles;
      return static_cast<std::size_t>(std::clamp(scaled, 0.0, tiles - 1.0));
    };
    return index(z.y(), calibration_.half_fov_y, options_.tiles_y) * static_cast<std::size_t>(options_.tiles_x) +
           index(z.x(), calibration_.half_fov_x, options_.tiles_x);
  }

  VisionOptions options_;
  SensorCalibration calibration_;
  std::array<std::uint32_t, kMaxTiles> tiles_{};
  int at_spot_ = 0;
  Vec2 spot_ = Vec2::Zero();
};

}  // namespace plumb
