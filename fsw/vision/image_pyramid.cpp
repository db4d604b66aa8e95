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

/// `count` columns of one row of the halved image. `centre` is the pixel that the first of them stands on.
void halve_strip(const std::uint8_t* centre, std::ptrdiff_t stride, std::int32_t count, std::uint8_t* out) {
  // Sums down the columns, at most 16 * 255, for the pixels in even and in odd columns; one more to the left and right.
  std::array<std::uint16_t, kStrip_px + 2 * kVector> even;
  std::array<std::uint16_t, kStrip_px + 2 * kVector> odd;
  const std::uint8_t* first = centre - 2 - 2 * stride;
  for (std::int32_t i = 0; i < count + 2; ++i) {
    const std::uint8_t* p = first + 2 * i;
    const std::uint16_t a = pair_at(p);
    const std::uint16_t b = pair_at(p + stride);
    const std::uint16_t c = pair_at(p + 2 * stride);
    const std::uint16_t d = pair_at(p + 3 * stride);
    const std::uint16_t e = pair_at(p + 4 * stride);
    even[i] = binomial(a & 0xFFU, b & 0xFFU, c & 0xFFU, d & 0xFFU, e & 0xFFU);
    odd[i] = binomial(a >> 8U, b >> 8U, c >> 8U, d >> 8U, e >> 8U);
  }
  for (std::int32_t i = 0; i < count; ++i) {
    // At most 256 * 255 + 128: it fits in 16 bits.
    const auto sum = static_cast<std::uint16_t>(binomial(even[i], odd[i], even[i + 1], odd[i + 1], even[i + 2]) + 128U);
    out[i] = static_cast<std::uint8_t>(sum >> 8U);
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
  std::array<std::int32_t, kImageMargin_px> left;
  std::array<std::int32_t, kImageMargin_px> right;
  for (std::int32_t i = 0; i < kImageMargin_px; ++i) {
    left[i] = mirrored(i - kImageMargin_px, image.width);
    right[i] = mirrored(image.width + i, image.width);
  }
  for (std::int32_t row = 0; row < image.height; ++row) {
    std::uint8_t* pixels = row_of(image, row);
    for (std::int32_t i = 0; i < kImageMargin_px; ++i) {
      pixels[i - kImageMargin_px] = pixels[left[i]];
      pixels[image.width + i] = pixels[right[i]];
    }
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
  for (std::int32_t row = 0; row < to.height; ++row) {
    const std::uint8_t* centre = from.pixels + static_cast<std::ptrdiff_t>(2 * row) * from.stride;
    for (std::int32_t left = 0; left < to.width; left += kStrip_px) {
      const std::int32_t whole = (to.width - left + kVector - 1) / kVector * kVector;
      halve_strip(centre + 2 * left, from.stride, std::min(whole, kStrip_px), row_of(to, row) + left);
    }
  }
}

}  // namespace plumb
