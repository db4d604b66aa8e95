#include "fsw/vision/image_pyramid.h"

#include <algorithm>
#include <bit>
#include <cstring>

namespace plumb {
namespace {

static_assert(std::endian::native == std::endian::little, "halve() takes two pixels at a time, the left one lowest");

// Columns of the halved image made at once. The last strip writes up to kVector - 1 columns into the margin, and reads
// twice as far.
constexpr std::int32_t kStrip_px = 64;
constexpr std::int32_t kVector = 8;
static_assert(2 * kVector < kImageMargin_px);

/// Index of the pixel that is seen at i in an image of n pixels between two mirrors: dcb|abcd|cba.
std::int32_t mirrored(std::int32_t i, std::int32_t n) {
  if (n == 1) return 0;
  const std::int32_t period = 2 * (n - 1);
  const std::int32_t phase = ((i % period) + period) % period;
  return phase < n ? phase : period - phase;
}

std::uint8_t* row_of(const MarginedImage& image, std::int32_t row) {
  return image.pixels + static_cast<std::ptrdiff_t>(row) * image.stride;
}

/// Two neighbouring pixels: the left one is the low byte.
std::uint16_t pair_at(const std::uint8_t* pixels) {
  std::uint16_t pair = 0;
  std::memcpy(&pair, pixels, sizeof(pair));
  return pair;
}

constexpr std::uint16_t binomial(std::uint16_t a, std::uint16_t b, std::uint16_t c, std::uint16_t d, std::uint16_t e) {
  return static_cast<std::uint16_t>(a + e + 4 * (b + d) + 6 * c);
}

// Sums along five pixels of a row, at most 16 * 255, one for each column of the halved image.
using SumRow = std::array<std::uint16_t, kStrip_px>;

/// `centre` is the pixel that the first sum stands on.
void sum_across(const std::uint8_t* centre, std::int32_t count, SumRow& out) {
  for (std::int32_t i = 0; i < count; ++i) {
    const std::uint16_t a = pair_at(centre + 2 * i - 2);
    const std::uint16_t b = pair_at(centre + 2 * i);
    const std::uint16_t c = pair_at(centre + 2 * i + 2);
    out[i] = binomial(a & 0xFFU, a >> 8U, b & 0xFFU, b >> 8U, c & 0xFFU);
  }
}

/// `count` columns of the halved image from `left` on, from top to bottom. Each row of `from` is summed up once.
void halve_strip(const ImageView& from, std::int32_t left, std::int32_t count, const MarginedImage& to) {
  std::array<SumRow, 5> rows;  // a ring
  const std::uint8_t* centre = from.pixels + 2 * left;
  const auto at = [&rows](std::int32_t row) -> SumRow& { return rows[static_cast<std::size_t>(row + 5) % 5]; };
  const auto fill = [&](std::int32_t row) {
    sum_across(centre + static_cast<std::ptrdiff_t>(row) * from.stride, count, at(row));
  };
  for (std::int32_t row = -2; row <= 0; ++row) fill(row);
  for (std::int32_t row = 0; row < to.height; ++row) {
    fill(2 * row + 1);
    fill(2 * row + 2);
    const SumRow& a = at(2 * row - 2);
    const SumRow& b = at(2 * row - 1);
    const SumRow& c = at(2 * row);
    const SumRow& d = at(2 * row + 1);
    const SumRow& e = at(2 * row + 2);
    std::uint8_t* out = row_of(to, row) + left;
    for (std::int32_t i = 0; i < count; ++i) {
      // At most 256 * 255 + 128: it fits in 16 bits.
      const auto sum = static_cast<std::uint16_t>(binomial(a[i], b[i], c[i], d[i], e[i]) + 128U);
      out[i] = static_cast<std::uint8_t>(sum >> 8U);
    }
  }
}

/// Both margins of one row of an image that is wider than its margin.
void mirror_row(std::uint8_t* pixels, std::int32_t width) {
  std::array<std::uint8_t, kImageMargin_px> left;
  std::array<std::uint8_t, kImageMargin_px> right;
  std::memcpy(left.data(), pixels + 1, left.size());
  std::memcpy(right.data(), pixels + width - 1 - kImageMargin_px, right.size());
  std::reverse_copy(left.begin(), left.end(), pixels - kImageMargin_px);
  std::reverse_copy(right.begin(), right.end(), pixels + width);
}

/// The same of an image that may be narrower, which shows its mirror image several times.
void mirror_narrow_row(std::uint8_t* pixels, std::int32_t width) {
  for (std::int32_t i = 1; i <= kImageMargin_px; ++i) {
    pixels[-i] = pixels[mirrored(-i, width)];
    pixels[width - 1 + i] = pixels[mirrored(width - 1 + i, width)];
  }
}

}  // namespace

void copy_pixels(const ImageView& from, const MarginedImage& to) {
  PLUMB_ASSERT(from.width == to.width && from.height == to.height);
  for (std::int32_t row = 0; row < from.height; ++row) {
    std::memcpy(row_of(to, row), from.pixels + static_cast<std::ptrdiff_t>(row) * from.stride,
                static_cast<std::size_t>(from.width));
  }
}

void mirror_margin(const MarginedImage& image) {
  const bool wide = image.width > kImageMargin_px;
  for (std::int32_t row = 0; row < image.height; ++row) {
    (wide ? mirror_row : mirror_narrow_row)(row_of(image, row), image.width);
  }
  const std::size_t bytes = static_cast<std::size_t>(image.width + 2 * kImageMargin_px);
  for (std::int32_t i = 1; i <= kImageMargin_px; ++i) {
    const std::int32_t above = mirrored(-i, image.height);
    const std::int32_t below = mirrored(image.height - 1 + i, image.height);
    std::memcpy(row_of(image, -i) - kImageMargin_px, row_of(image, above) - kImageMargin_px, bytes);
    std::memcpy(row_of(image, image.height - 1 + i) - kImageMargin_px, row_of(image, below) - kImageMargin_px, bytes);
  }
}

void halve(const ImageView& from, const MarginedImage& to) {
  PLUMB_ASSERT(to.width == (from.width + 1) / 2 && to.height == (from.height + 1) / 2);
  for (std::int32_t left = 0; left < to.width; left += kStrip_px) {
    const std::int32_t whole = (to.width - left + kVector - 1) / kVector * kVector;
    halve_strip(from, left, std::min(whole, kStrip_px), to);
  }
}

}  // namespace plumb
