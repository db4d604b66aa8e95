#include "fsw/vision/image_pyramid.h"

#include <bit>
#include <cstring>

#include "fsw/vision/vector_types.h"

namespace plumb {
namespace {

static_assert(std::endian::native == std::endian::little, "halve() takes two pixels at a time, the left one lowest");

using Sums = cv::v_uint16;
// Columns of the halved image made at once. The last ones may reach kVector - 1 columns into the margin, and read twice
// as far.
constexpr std::int32_t kVector = Sums::nlanes;
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

/// a + 4 b + 6 c + 4 d + e: below 2^16 for pixels as for sums of them along a row.
Sums binomial(const Sums& a, const Sums& b, const Sums& c, const Sums& d, const Sums& e) {
  const Sums inner = cv::v_mul_wrap(cv::v_add_wrap(b, d), cv::vx_setall_u16(4));
  return cv::v_add_wrap(cv::v_add_wrap(cv::v_add_wrap(a, e), inner), cv::v_mul_wrap(c, cv::vx_setall_u16(6)));
}

/// Every second pixel from one on, and those between them.
struct Columns {
  Sums even;
  Sums odd;
};

Columns columns_from(const std::uint8_t* pixels) {
#if CV_NEON
  const uint8x8x2_t both = vld2_u8(pixels);
  return {Sums(vmovl_u8(both.val[0])), Sums(vmovl_u8(both.val[1]))};
#else
  const Sums pairs = cv::v_reinterpret_as_u16(cv::vx_load(pixels));
  return {pairs & cv::vx_setall_u16(0xFF), cv::v_shr<8>(pairs)};
#endif
}

/// Sums along five pixels of a row, at most 16 * 255, for kVector columns of the halved image. `centre` is the pixel
/// that the first sum stands on.
Sums sum_across(const std::uint8_t* centre) {
  const Columns before = columns_from(centre - 2);
  const Columns at = columns_from(centre);
  return binomial(before.even, before.odd, at.even, at.odd, columns_from(centre + 2).even);
}

/// kVector columns of the halved image from `left` on, from top to bottom: each row of `from` is summed up once, and
/// the sums never leave the registers.
void halve_columns(const ImageView& from, std::int32_t left, const MarginedImage& to) {
  const std::ptrdiff_t down = from.stride;
  const std::ptrdiff_t out_down = to.stride;
  const std::uint8_t* centre = from.pixels + 2 * left;
  std::uint8_t* out = to.pixels + left;
  std::uint8_t* const end = row_of(to, to.height) + left;
  Sums a = sum_across(centre - 2 * down);
  Sums b = sum_across(centre - down);
  Sums c = sum_across(centre);
  for (; out != end; out += out_down) {
    const Sums d = sum_across(centre + down);
    centre += 2 * down;
    const Sums e = sum_across(centre);
    cv::v_rshr_pack_store<8>(out, binomial(a, b, c, d, e));
    a = c;
    b = d;
    c = e;
  }
}

/// Both margins of one row of an image that is wider than its margin.
void mirror_row(std::uint8_t* pixels, std::int32_t width) {
  constexpr std::int32_t kStep = cv::v_uint8x16::nlanes;
  static_assert(kImageMargin_px % kStep == 0);
  std::uint8_t* const last = pixels + width - 1;
  for (std::int32_t i = 1; i <= kImageMargin_px; i += kStep) {
    cv::v_store(pixels - i - kStep + 1, cv::v_reverse(cv::v_load(pixels + i)));
    cv::v_store(last + i, cv::v_reverse(cv::v_load(last - i - kStep + 1)));
  }
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
  for (std::int32_t left = 0; left < to.width; left += kVector) halve_columns(from, left, to);
}

}  // namespace plumb
