#pragma once
// Bookkeeping for spreading features over the image: a grid of tiles with a count each, and per tile a bounded list of
// the best candidates. A tile that overflows loses its weakest candidates, never all of them.

#include <array>
#include <cstddef>
#include <cstdint>

#include "fsw/base/assert.h"
#include "fsw/base/fixed_vector.h"

namespace plumb {

/// Half-open rectangle of pixels.
struct TileRect {
  std::int32_t left = 0;    ///< px, first column
  std::int32_t top = 0;     ///< px, first row
  std::int32_t right = 0;   ///< px, column after the last
  std::int32_t bottom = 0;  ///< px, row after the last
};

/// Divides the image inside a border into columns x rows tiles of nearly equal size.
template <std::size_t MaxTiles>
class TileGrid {
 public:
  TileGrid() = default;
  /// Precondition: 1 <= columns * rows <= MaxTiles and at least one pixel a tile inside the border.
  TileGrid(std::int32_t width_px, std::int32_t height_px, std::int32_t columns, std::int32_t rows,
           std::int32_t border_px)
      : columns_(columns),
        rows_(rows),
        border_px_(border_px),
        inner_width_px_(width_px - 2 * border_px),
        inner_height_px_(height_px - 2 * border_px) {
    PLUMB_ASSERT(columns >= 1 && rows >= 1 && static_cast<std::size_t>(columns * rows) <= MaxTiles);
    PLUMB_ASSERT(border_px >= 0 && inner_width_px_ >= columns && inner_height_px_ >= rows);
  }

  std::size_t size() const { return static_cast<std::size_t>(columns_ * rows_); }

  TileRect rect(std::size_t tile) const {
    PLUMB_ASSERT(tile < size());
    const std::int32_t column = static_cast<std::int32_t>(tile) % columns_;
    const std::int32_t row = static_cast<std::int32_t>(tile) / columns_;
    return {border_px_ + column * inner_width_px_ / columns_, border_px_ + row * inner_height_px_ / rows_,
            border_px_ + (column + 1) * inner_width_px_ / columns_, border_px_ + (row + 1) * inner_height_px_ / rows_};
  }

  /// The tile of a pixel; pixels in the border belong to the nearest tile.
  std::size_t tile_of(float u_px, float v_px) const {
    return static_cast<std::size_t>(index(v_px, inner_height_px_, rows_) * columns_ +
                                    index(u_px, inner_width_px_, columns_));
  }

  void clear_counts() { counts_.fill(0); }
  void add(float u_px, float v_px) { ++counts_[tile_of(u_px, v_px)]; }
  std::int32_t count(std::size_t tile) const {
    PLUMB_ASSERT(tile < size());
    return counts_[tile];
  }

 private:
  std::int32_t index(float coordinate_px, std::int32_t extent_px, std::int32_t tiles) const {
    // Whole pixels, and the exact inverse of rect(): the largest i with i * extent / tiles <= pixel.
    const std::int32_t pixel = static_cast<std::int32_t>(coordinate_px) - border_px_;
    if (pixel < 0) return 0;
    const std::int32_t i = ((pixel + 1) * tiles - 1) / extent_px;
    return i < tiles ? i : tiles - 1;
  }

  std::int32_t columns_ = 1;
  std::int32_t rows_ = 1;
  std::int32_t border_px_ = 0;
  std::int32_t inner_width_px_ = 1;
  std::int32_t inner_height_px_ = 1;
  std::array<std::int32_t, MaxTiles> counts_{};
};

/// A detected corner.
struct Corner {
  float u_px = 0.0F;
  float v_px = 0.0F;
  float score = 0.0F;  ///< the larger the better; its unit is the detector's
};

/// Total order, best first: no two distinct corners tie, so that the choice never depends on the detector's order.
constexpr bool better_corner(const Corner& a, const Corner& b) {
  if (a.score != b.score) return a.score > b.score;
  if (a.v_px != b.v_px) return a.v_px < b.v_px;
  return a.u_px < b.u_px;
}

/// The best Capacity corners offered so far, best first.
template <std::size_t Capacity>
class BestCorners {
 public:
  void clear() { corners_.clear(); }
  /// Keeps the corner if it is among the best; the weakest makes room.
  void offer(const Corner& corner) {
    if (corners_.full()) {
      if (!better_corner(corner, corners_.back())) return;
      corners_.pop_back();
    }
    (void)corners_.push_back(corner);  // there is room: one was just removed if it was full
    for (std::size_t i = corners_.size() - 1; i > 0 && better_corner(corners_[i], corners_[i - 1]); --i) {
      const Corner swapped = corners_[i];
      corners_[i] = corners_[i - 1];
      corners_[i - 1] = swapped;
    }
  }
  std::size_t size() const { return corners_.size(); }
  const Corner& operator[](std::size_t i) const { return corners_[i]; }

 private:
  FixedVector<Corner, Capacity> corners_;
};

}  // namespace plumb
