#include "test/support/sim/world.h"

#include <algorithm>
#include <cmath>

#include "test/support/sim/random.h"

namespace plumb::sim {
namespace {

/// Two points on one surface see each other although rounding may put one a hair below it.
constexpr double kContact_m = 1e-6;
constexpr double kParallel = 1e-12;

}  // namespace

World& World::add_box(const Vec2& low_m, const Vec2& high_m, double height_m) {
  Block block{{low_m.x(), low_m.y(), 0.0}, {high_m.x(), high_m.y(), height_m}, {}};
  block.faces = {{-Vec3::UnitX(), -low_m.x()},
                 {Vec3::UnitX(), high_m.x()},
                 {-Vec3::UnitY(), -low_m.y()},
                 {Vec3::UnitY(), high_m.y()},
                 {Vec3::UnitZ(), height_m}};
  blocks_.push_back(block);
  return *this;
}

World& World::add_gable(const Vec2& low_m, const Vec2& high_m, double eaves_m, double ridge_m) {
  add_box(low_m, high_m, ridge_m);
  Block& block = blocks_.back();
  const double half_width_m = 0.5 * (high_m.x() - low_m.x());
  const double rise_m = ridge_m - eaves_m;
  const Vec3 up_left = Vec3(-rise_m, 0.0, half_width_m).normalized();
  const Vec3 up_right = Vec3(rise_m, 0.0, half_width_m).normalized();
  block.faces.pop_back();
  block.faces.push_back({up_left, up_left.dot(Vec3(low_m.x(), 0.0, eaves_m))});
  block.faces.push_back({up_right, up_right.dot(Vec3(high_m.x(), 0.0, eaves_m))});
  return *this;
}

bool World::misses_bounds(const Block& block, const Vec3& origin_m, const Vec3& direction, double max_range_m) {
  for (int axis = 0; axis < 3; ++axis) {
    const double a = origin_m[axis];
    const double b = a + max_range_m * direction[axis];
    if (std::max(a, b) < block.low_m[axis] || std::min(a, b) > block.high_m[axis]) return true;
  }
  return false;
}

void World::cast_block(const Block& block, const Vec3& origin_m, const Vec3& direction, std::optional<Hit>& nearest,
                       double max_range_m) {
  const double limit_m = nearest ? nearest->range_m : max_range_m;
  if (misses_bounds(block, origin_m, direction, limit_m)) return;
  double enter_m = 0.0;
  double leave_m = limit_m;
  const HalfSpace* entered = nullptr;
  for (const HalfSpace& face : block.faces) {
    const double slope = face.normal.dot(direction);
    const double gap_m = face.offset_m - face.normal.dot(origin_m);  // negative: outside this face
    if (std::abs(slope) < kParallel) {
      if (gap_m < 0.0) return;
      continue;
    }
    const double range_m = gap_m / slope;
    if (slope < 0.0 && range_m > enter_m) {
      enter_m = range_m;
      entered = &face;
    }
    if (slope > 0.0) leave_m = std::min(leave_m, range_m);
  }
  if (entered == nullptr || enter_m > leave_m) return;
  nearest = Hit{enter_m, origin_m + enter_m * direction, entered->normal};
}

std::optional<Hit> World::cast(const Vec3& origin_m, const Vec3& direction, double max_range_m) const {
  std::optional<Hit> nearest;
  if (direction.z() < -kParallel && origin_m.z() >= 0.0) {
    const double range_m = -origin_m.z() / direction.z();
    if (range_m <= max_range_m) nearest = Hit{range_m, origin_m + range_m * direction, Vec3::UnitZ()};
  }
  for (const Block& block : blocks_) cast_block(block, origin_m, direction, nearest, max_range_m);
  return nearest;
}

bool World::visible(const Vec3& from_m, const Vec3& to_m) const {
  const Vec3 path = to_m - from_m;
  const double distance_m = path.norm();
  return distance_m < kContact_m || !cast(from_m, path / distance_m, distance_m - kContact_m).has_value();
}

World flat_ground() { return World{}; }

World stepped_ground(std::uint64_t seed, double max_height_m) {
  constexpr std::uint64_t kWorldStream = 100;
  constexpr double kClear_m = 4.0;  // around the take-off point
  constexpr double kEnd_m = 160.0;
  constexpr double kHalfWidth_m = 14.0;
  Random random(seed, kWorldStream);
  World world;
  for (double y = -kHalfWidth_m; y < kHalfWidth_m;) {
    const double depth_m = random.uniform(3.0, 6.0);
    for (double x = -16.0; x < kEnd_m;) {
      const double width_m = random.uniform(2.0, 6.0);
      const double height_m = random.uniform(0.0, max_height_m);
      const bool on_pad = x < kClear_m && x + width_m > -kClear_m && y < kClear_m && y + depth_m > -kClear_m;
      if (!on_pad) world.add_box({x, y}, {x + width_m, y + depth_m}, height_m);
      x += width_m;
    }
    y += depth_m;
  }
  return world;
}

World box_line(std::uint64_t seed) {
  constexpr std::uint64_t kWorldStream = 101;
  constexpr double kEnd_m = 14.0;
  constexpr double kHalfWidth_m = 0.35;
  Random random(seed, kWorldStream);
  World world;
  for (double x = -0.6; x < kEnd_m;) {
    const double length_m = random.uniform(0.35, 0.7);
    world.add_box({x, -kHalfWidth_m}, {x + length_m, kHalfWidth_m}, random.uniform(0.1, 0.75));
    x += length_m + random.uniform(0.0, 0.2);
  }
  return world;
}

World flat_then_roofs() {
  constexpr double kFirst_m = 60.0;
  constexpr double kEnd_m = 160.0;
  World world;
  for (double x = kFirst_m; x < kEnd_m; x += 11.0) {
    for (double y = -14.0; y < 14.0; y += 14.0) world.add_gable({x, y}, {x + 8.0, y + 12.0}, 2.5, 4.5);
  }
  return world;
}

}  // namespace plumb::sim
