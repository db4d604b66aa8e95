#pragma once
// The ground under the flight: the plane z = 0 and convex blocks standing on it, with exact ray casting. The laser and
// the landmarks both come from cast(), so they agree on where the surface is.

#include <cstdint>
#include <optional>
#include <vector>

#include "fsw/math/so3.h"

namespace plumb::sim {

struct Hit {
  double range_m = 0.0;
  Vec3 point_m = Vec3::Zero();  ///< in W
  Vec3 normal = Vec3::UnitZ();  ///< outward, unit length, in W
};

class World {
 public:
  /// A box with vertical walls from the ground up.
  World& add_box(const Vec2& low_m, const Vec2& high_m, double height_m);
  /// A house along y: vertical walls and two roof planes that meet in a ridge at x midway between low and high.
  World& add_gable(const Vec2& low_m, const Vec2& high_m, double eaves_m, double ridge_m);

  /// The first surface along the unit direction, or nothing within max_range_m.
  std::optional<Hit> cast(const Vec3& origin_m, const Vec3& direction, double max_range_m) const;
  /// True when nothing stands between the two points; surfaces at `to` itself do not count.
  bool visible(const Vec3& from_m, const Vec3& to_m) const;

 private:
  struct HalfSpace {
    Vec3 normal;      ///< outward
    double offset_m;  ///< inside: normal . x <= offset
  };
  struct Block {
    Vec3 low_m;  ///< bounding box, for quick rejection
    Vec3 high_m;
    std::vector<HalfSpace> faces;
  };

  static bool misses_bounds(const Block& block, const Vec3& origin_m, const Vec3& direction, double max_range_m);
  static void cast_block(const Block& block, const Vec3& origin_m, const Vec3& direction, std::optional<Hit>& nearest,
                         double max_range_m);

  std::vector<Block> blocks_;
};

World flat_ground();
/// Flat for 4 m around the take-off point, then a pavement of blocks 0 to `max_height_m` high all along the x axis. The
/// layout is a function of the seed.
World stepped_ground(std::uint64_t seed = 1, double max_height_m = 2.0);
/// Flat for the first 60 m along x, then rows of gabled houses: the paper's outdoor flight.
World flat_then_roofs();
/// Boxes of 0.1 to 0.75 m in a line along x, 14 m of them: the paper's stress test. The layout is a function of the
/// seed.
World box_line(std::uint64_t seed);

}  // namespace plumb::sim
