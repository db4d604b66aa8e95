#include "fsw/vision/tiles.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "test/support/property.h"

namespace plumb {
namespace {

TEST(TileGrid, TilesCoverTheImageInsideTheBorderOnce) {
  test::for_all(100, [](test::Generator& g) {
    const auto width = static_cast<std::int32_t>(g.integer(100, 800));
    const auto height = static_cast<std::int32_t>(g.integer(100, 800));
    const auto columns = static_cast<std::int32_t>(g.integer(1, 8));
    const auto rows = static_cast<std::int32_t>(g.integer(1, 8));
    const auto border = static_cast<std::int32_t>(g.integer(0, 20));
    const TileGrid<64> grid(width, height, columns, rows, border);
    std::int64_t area = 0;
    for (std::size_t tile = 0; tile < grid.size(); ++tile) {
      const TileRect r = grid.rect(tile);
      area += static_cast<std::int64_t>(r.right - r.left) * (r.bottom - r.top);
      // The corners of a tile belong to it, so no pixel lies in two tiles.
      EXPECT_EQ(grid.tile_of(static_cast<float>(r.left), static_cast<float>(r.top)), tile);
      EXPECT_EQ(grid.tile_of(static_cast<float>(r.right) - 0.5F, static_cast<float>(r.bottom) - 0.5F), tile);
    }
    EXPECT_EQ(area, static_cast<std::int64_t>(width - 2 * border) * (height - 2 * border));
  });
}

TEST(TileGrid, PixelsInTheBorderBelongToTheNearestTile) {
  const TileGrid<48> grid(752, 480, 8, 6, 8);
  EXPECT_EQ(grid.tile_of(0.0F, 0.0F), 0U);
  EXPECT_EQ(grid.tile_of(751.0F, 479.0F), 47U);
}

TEST(TileGrid, Counts) {
  TileGrid<4> grid(100, 100, 2, 2, 0);
  grid.add(10.0F, 10.0F);
  grid.add(20.0F, 10.0F);
  grid.add(60.0F, 70.0F);
  EXPECT_EQ(grid.count(0), 2);
  EXPECT_EQ(grid.count(1), 0);
  EXPECT_EQ(grid.count(3), 1);
  grid.clear_counts();
  EXPECT_EQ(grid.count(0), 0);
}

// Reference fault F27: a tile with too many features lost all of them.
TEST(BestCorners, AnOverfullTileKeepsItsBest) {
  test::for_all(200, [](test::Generator& g) {
    BestCorners<5> best;
    std::vector<Corner> all;
    const std::int64_t count = g.integer(0, 40);
    for (std::int64_t i = 0; i < count; ++i) {
      const Corner corner{static_cast<float>(i % 7), static_cast<float>(i), static_cast<float>(g.integer(0, 9))};
      all.push_back(corner);
      best.offer(corner);
    }
    std::sort(all.begin(), all.end(), better_corner);
    ASSERT_EQ(best.size(), std::min<std::size_t>(all.size(), 5));
    for (std::size_t i = 0; i < best.size(); ++i) {
      EXPECT_EQ(best[i].score, all[i].score);
      EXPECT_EQ(best[i].v_px, all[i].v_px);
    }
  });
}

TEST(BestCorners, TheOrderOfOffersDoesNotMatter) {
  const Corner a{1.0F, 2.0F, 5.0F};
  const Corner b{3.0F, 2.0F, 5.0F};
  const Corner c{0.0F, 1.0F, 5.0F};
  BestCorners<2> forward;
  for (const Corner& corner : {a, b, c}) forward.offer(corner);
  BestCorners<2> backward;
  for (const Corner& corner : {c, b, a}) backward.offer(corner);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(forward[i].u_px, backward[i].u_px);
    EXPECT_EQ(forward[i].v_px, backward[i].v_px);
  }
}

}  // namespace
}  // namespace plumb
