// Ray casting against cases that can be worked out by hand, and against the blocks' own definition.

#include "test/support/sim/world.h"

#include <gtest/gtest.h>

#include "test/support/property.h"

namespace plumb::sim {
namespace {

constexpr double kFar_m = 100.0;

TEST(World, PlaneIsHitWhereTheRayMeetsIt) {
  const World world = flat_ground();
  const Vec3 ray = Vec3(1.0, 0.0, -1.0).normalized();
  const std::optional<Hit> hit = world.cast({2.0, 3.0, 4.0}, ray, kFar_m);
  ASSERT_TRUE(hit.has_value());
  EXPECT_NEAR((hit->point_m - Vec3(6.0, 3.0, 0.0)).norm(), 0.0, 1e-12);
  EXPECT_EQ(hit->normal, Vec3::UnitZ());
  EXPECT_FALSE(world.cast({2.0, 3.0, 4.0}, Vec3::UnitX(), kFar_m).has_value());
  EXPECT_FALSE(world.cast({2.0, 3.0, 4.0}, ray, 1.0).has_value());
}

TEST(World, BoxShowsItsTopAndItsWalls) {
  World world;
  world.add_box({1.0, -1.0}, {3.0, 1.0}, 2.0);
  const std::optional<Hit> top = world.cast({2.0, 0.0, 5.0}, -Vec3::UnitZ(), kFar_m);
  ASSERT_TRUE(top.has_value());
  EXPECT_NEAR(top->range_m, 3.0, 1e-12);
  EXPECT_EQ(top->normal, Vec3::UnitZ());
  const std::optional<Hit> wall = world.cast({0.0, 0.0, 1.0}, Vec3::UnitX(), kFar_m);
  ASSERT_TRUE(wall.has_value());
  EXPECT_NEAR(wall->range_m, 1.0, 1e-12);
  EXPECT_EQ(wall->normal, -Vec3::UnitX());
  EXPECT_FALSE(world.cast({0.0, 1.5, 1.0}, Vec3::UnitX(), kFar_m).has_value());
}

TEST(World, GableRoofRisesToItsRidge) {
  World world;
  world.add_gable({0.0, 0.0}, {8.0, 10.0}, 2.0, 4.0);
  for (double x = 0.5; x < 8.0; x += 0.5) {
    const std::optional<Hit> hit = world.cast({x, 5.0, 10.0}, -Vec3::UnitZ(), kFar_m);
    ASSERT_TRUE(hit.has_value());
    EXPECT_NEAR(hit->point_m.z(), 2.0 + 2.0 * (1.0 - std::abs(x - 4.0) / 4.0), 1e-12);
  }
}

TEST(World, BlocksHideWhatIsBehindThem) {
  World world;
  world.add_box({1.0, -1.0}, {2.0, 1.0}, 3.0);
  EXPECT_FALSE(world.visible({0.0, 0.0, 1.0}, {4.0, 0.0, 0.0}));
  EXPECT_TRUE(world.visible({0.0, 0.0, 1.0}, {1.0, 0.0, 1.0}));  // a point on the near wall
  EXPECT_TRUE(world.visible({0.0, 5.0, 1.0}, {4.0, 5.0, 0.0}));
}

TEST(World, NothingIsHitBeforeTheHit) {
  const World world = stepped_ground();
  test::for_all(1000, [&](test::Generator& g) {
    const Vec3 origin_m(g.uniform(0.0, 120.0), g.uniform(-5.0, 5.0), 11.0);
    const Vec3 ray = Vec3(g.uniform(-0.8, 0.8), g.uniform(-0.6, 0.6), -1.0).normalized();
    const std::optional<Hit> hit = world.cast(origin_m, ray, kFar_m);
    ASSERT_TRUE(hit.has_value());
    EXPECT_LT((origin_m + hit->range_m * ray - hit->point_m).norm(), 1e-12);
    // The surface is where the view along the ray ends.
    EXPECT_TRUE(world.visible(origin_m, hit->point_m - 1e-4 * ray));
    EXPECT_FALSE(world.visible(origin_m, hit->point_m + 1e-4 * ray));
  });
}

}  // namespace
}  // namespace plumb::sim
