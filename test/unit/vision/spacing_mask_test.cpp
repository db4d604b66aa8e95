#include "fsw/vision/spacing_mask.h"

#include <gtest/gtest.h>

#include <cmath>

#include "test/support/property.h"

namespace plumb {
namespace {

constexpr std::int32_t kWidth = 752;
constexpr std::int32_t kHeight = 480;
constexpr std::int32_t kRadius_px = 16;
constexpr double kCell_px = 3.0;  // 752 px over at most 256 cells

TEST(SpacingMask, KnowsNearFromFarToACell) {
  SpacingMask mask(kWidth, kHeight, kRadius_px);
  test::for_all(300, [&](test::Generator& g) {
    mask.clear();
    const auto u = static_cast<float>(g.uniform(0.0, kWidth - 1.0));
    const auto v = static_cast<float>(g.uniform(0.0, kHeight - 1.0));
    mask.take(u, v);
    EXPECT_TRUE(mask.is_taken(u, v));
    const auto other_u = static_cast<float>(g.uniform(0.0, kWidth - 1.0));
    const auto other_v = static_cast<float>(g.uniform(0.0, kHeight - 1.0));
    const double distance_px = std::hypot(static_cast<double>(other_u - u), static_cast<double>(other_v - v));
    if (distance_px > kRadius_px + kCell_px) {
      EXPECT_FALSE(mask.is_taken(other_u, other_v));
    }
    if (distance_px < kRadius_px - kCell_px) {
      EXPECT_TRUE(mask.is_taken(other_u, other_v));
    }
  });
}

TEST(SpacingMask, WithoutRadiusTakesItsOwnCell) {
  SpacingMask mask(kWidth, kHeight, 0);
  mask.take(100.0F, 100.0F);
  EXPECT_TRUE(mask.is_taken(100.0F, 100.0F));
  EXPECT_FALSE(mask.is_taken(110.0F, 100.0F));
}

TEST(SpacingMask, PointsOutsideTheImageDoNoHarm) {
  SpacingMask mask(kWidth, kHeight, kRadius_px);
  mask.take(-5.0F, 1000.0F);
  EXPECT_TRUE(mask.is_taken(0.0F, 479.0F));
}

}  // namespace
}  // namespace plumb
