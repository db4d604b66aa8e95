#pragma once
// Remembers which parts of the image lie near a feature, on cells a few pixels wide, so that asking costs one look-up.

#include <array>
#include <cstddef>
#include <cstdint>

#include "fsw/base/assert.h"

namespace plumb {

class SpacingMask {
 public:
  static constexpr std::int32_t kMaxColumns = 256;
  static constexpr std::int32_t kMaxRows = 192;

  SpacingMask() = default;
  /// Cells are as small as the capacity allows: 3 px for 752 x 480. Precondition: sizes positive, radius >= 0.
  SpacingMask(std::int32_t width_px, std::int32_t height_px, std::int32_t radius_px) : radius_px_(radius_px) {
    PLUMB_ASSERT(width_px > 0 && height_px > 0 && radius_px >= 0);
    const std::int32_t across = (width_px + kMaxColumns - 1) / kMaxColumns;
    const std::int32_t down = (height_px + kMaxRows - 1) / kMaxRows;
    cell_px_ = across > down ? across : down;
    columns_ = (width_px + cell_px_ - 1) / cell_px_;
    rows_ = (height_px + cell_px_ - 1) / cell_px_;
  }

  void clear() { taken_.fill(0); }

  /// Takes every cell whose centre lies within the radius of the point, and the point's own cell.
  void take(float u_px, float v_px) {
    const std::int32_t u = static_cast<std::int32_t>(u_px);
    const std::int32_t v = static_cast<std::int32_t>(v_px);
    const std::int32_t reach = radius_px_ / cell_px_ + 1;
    const std::int32_t column = clamp(u / cell_px_, columns_);
    const std::int32_t row = clamp(v / cell_px_, rows_);
    for (std::int32_t r = clamp(row - reach, rows_); r <= clamp(row + reach, rows_); ++r) {
      for (std::int32_t c = clamp(column - reach, columns_); c <= clamp(column + reach, columns_); ++c) {
        const std::int32_t du = c * cell_px_ + cell_px_ / 2 - u;
        const std::int32_t dv = r * cell_px_ + cell_px_ / 2 - v;
        if (du * du + dv * dv <= radius_px_ * radius_px_) taken_[index(c, r)] = 1;
      }
    }
    taken_[index(column, row)] = 1;
  }

  bool is_taken(float u_px, float v_px) const {
    return taken_[index(clamp(static_cast<std::int32_t>(u_px) / cell_px_, columns_),
                        clamp(static_cast<std::int32_t>(v_px) / cell_px_, rows_))] != 0;
  }

 private:
  static std::int32_t clamp(std::int32_t i, std::int32_t count) { return i < 0 ? 0 : (i < count ? i : count - 1); }
  static std::size_t index(std::int32_t column, std::int32_t row) {
    return static_cast<std::size_t>(row * kMaxColumns + column);
  }

  std::int32_t radius_px_ = 0;
  std::int32_t cell_px_ = 1;
  std::int32_t columns_ = 1;
  std::int32_t rows_ = 1;
  std::array<std::uint8_t, static_cast<std::size_t>(kMaxColumns) * kMaxRows> taken_{};
};

}  // namespace plumb
