#pragma once
// A grey image and its halvings, each inside a margin that mirrors it, so that a patch that hangs out of the image is
// read without a test. All arithmetic is on integers: the same bits on every machine.
//
// Cost: each pixel of each level is written once and read about five times, 4/3 of the image in all.

#include <array>
#include <cstddef>
#include <cstdint>

#include "fsw/base/assert.h"
#include "fsw/base/fixed_vector.h"
#include "fsw/measurement/samples.h"

namespace plumb {

/// Pixels around each level that can be read, too. A row of the largest patch that touches the image fits in.
inline constexpr std::int32_t kImageMargin_px = 48;

/// An ImageView whose pixels and margin can be written.
struct MarginedImage {
  std::uint8_t* pixels = nullptr;  ///< the first one inside the margin
  std::int32_t width = 0;          ///< px
  std::int32_t height = 0;         ///< px
  std::int32_t stride = 0;         ///< bytes from row to row

  ImageView view() const { return {pixels, width, height, stride}; }
};

/// Copies the pixels. Precondition: the same size.
void copy_pixels(const ImageView& from, const MarginedImage& to);
/// Fills the margin with the image mirrored at its outermost pixels, as often as it takes.
void mirror_margin(const MarginedImage& image);
/// Smooths with the binomial (1 4 6 4 1)/16 in both directions and keeps every other pixel, rounding to the nearest
/// grey level: Burt and Adelson 1983, and what cv::pyrDown does. The margin is used as it is beyond the edges of
/// `from`; that of `to` is then undefined. Precondition: `to` is half as large, rounded up.
void halve(const ImageView& from, const MarginedImage& to);

template <std::size_t MaxWidth, std::size_t MaxHeight, std::size_t MaxLevels>
class ImagePyramid {
 public:
  /// Level 0 is the image; each further one is half the size, rounded up, as long as both sides are longer than
  /// `shortest_px` and there are at most `levels`. Precondition: the image fits, 1 <= levels <= MaxLevels.
  void build(const ImageView& image, std::int32_t levels, std::int32_t shortest_px) {
    PLUMB_ASSERT(image.width > 0 && static_cast<std::size_t>(image.width) <= MaxWidth);
    PLUMB_ASSERT(image.height > 0 && static_cast<std::size_t>(image.height) <= MaxHeight);
    PLUMB_ASSERT(levels >= 1 && static_cast<std::size_t>(levels) <= MaxLevels);
    levels_.clear();
    add_level(image.width, image.height);
    copy_pixels(image, levels_.back());
    mirror_margin(levels_.back());
    for (std::int32_t i = 1; i < levels; ++i) {
      const MarginedImage last = levels_.back();
      const std::int32_t width = (last.width + 1) / 2;
      const std::int32_t height = (last.height + 1) / 2;
      if (width <= shortest_px || height <= shortest_px) return;
      add_level(width, height);
      halve(last.view(), levels_.back());
      mirror_margin(levels_.back());
    }
  }

  /// Levels there are; 0 before the first image.
  std::int32_t size() const { return static_cast<std::int32_t>(levels_.size()); }
  ImageView level(std::int32_t i) const { return levels_[static_cast<std::size_t>(i)].view(); }

 private:
  static constexpr std::size_t kMargin = kImageMargin_px;
  static constexpr std::size_t stride_at(std::size_t level) {
    const std::size_t width = ((MaxWidth - 1) >> level) + 1;
    return (width + 2 * kMargin + 15) / 16 * 16;
  }
  static constexpr std::size_t bytes_at(std::size_t level) {
    return stride_at(level) * (((MaxHeight - 1) >> level) + 1 + 2 * kMargin);
  }
  static constexpr std::size_t offset_of(std::size_t level) {
    std::size_t offset = 0;
    for (std::size_t i = 0; i < level; ++i) offset += bytes_at(i);
    return offset;
  }

  void add_level(std::int32_t width, std::int32_t height) {
    const std::size_t stride = stride_at(levels_.size());
    std::uint8_t* pixels = bytes_.data() + offset_of(levels_.size()) + kMargin * stride + kMargin;
    (void)levels_.push_back({pixels, width, height, static_cast<std::int32_t>(stride)});
  }

  alignas(16) std::array<std::uint8_t, offset_of(MaxLevels)> bytes_{};
  FixedVector<MarginedImage, MaxLevels> levels_;
};

}  // namespace plumb
