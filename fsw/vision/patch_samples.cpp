#include "fsw/vision/patch_samples.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <tuple>

#include "fsw/vision/vector_types.h"

namespace plumb {
namespace {

using Floats = cv::v_float32;
using Squares = cv::v_uint32;
constexpr std::size_t kLanes = Floats::nlanes;

constexpr std::size_t kParts = 8;
using Parts = std::array<float, kParts>;
constexpr std::size_t kVectors = kParts / kLanes;
static_assert(kParts % kLanes == 0);

float total(const Parts& parts) {
  return ((parts[0] + parts[4]) + (parts[2] + parts[6])) + ((parts[1] + parts[5]) + (parts[3] + parts[7]));
}

/// Between neighbouring columns, `a` px beyond the left one.
template <std::size_t Columns>
void interpolate_across(const std::uint8_t* pixels, float a, std::array<float, Columns>& out) {
  for (std::size_t c = 0; c < Columns; ++c) {
    const auto left = static_cast<float>(pixels[c]);
    out[c] = left + a * (static_cast<float>(pixels[c + 1]) - left);
  }
}

/// Two neighbouring pixels: the left one is the low byte.
std::uint16_t pair_at(const std::uint8_t* pixels) {
  static_assert(std::endian::native == std::endian::little);
  std::uint16_t pair = 0;
  std::memcpy(&pair, pixels, sizeof(pair));
  return pair;
}

/// Of each place the four neighbours, from the upper left in the low byte on. They are put together in registers: a
/// wide load waits for narrow stores.
Squares squares_at(const std::uint8_t* upper, const std::uint8_t* lower, const std::array<std::int32_t, kLanes>& at) {
  const auto u = [&](std::size_t i) { return pair_at(upper + at[i]); };
  const auto l = [&](std::size_t i) { return pair_at(lower + at[i]); };
#if CV_SIMD_WIDTH == 32
  return cv::v_reinterpret_as_u32(
      cv::v_uint16(u(0), l(0), u(1), l(1), u(2), l(2), u(3), l(3), u(4), l(4), u(5), l(5), u(6), l(6), u(7), l(7)));
#else
  return cv::v_reinterpret_as_u32(cv::v_uint16(u(0), l(0), u(1), l(1), u(2), l(2), u(3), l(3)));
#endif
}

/// Offsets of the columns from `first` on, in px from the centre. What hangs over at the end of a row stays in the
/// patch.
Floats columns_from(std::int32_t first) {
  std::array<float, kLanes> columns;
  for (std::size_t i = 0; i < kLanes; ++i) {
    columns[i] = static_cast<float>(std::min(first + static_cast<std::int32_t>(i), kPatchSide_px - 1) - kPatchHalf_px);
  }
  return cv::vx_load(columns.data());
}

}  // namespace

void sample_wide(const ImageView& image, float u_px, float v_px, WidePatchSamples& out) {
  constexpr std::int32_t kSide = kWidePatchSide_px;
  const auto column = static_cast<std::int32_t>(u_px);
  const auto row = static_cast<std::int32_t>(v_px);
  const float a = u_px - static_cast<float>(column);
  const float b = v_px - static_cast<float>(row);
  std::array<float, kSide> upper;
  std::array<float, kSide> lower;
  const std::uint8_t* pixels =
      image.pixels + static_cast<std::ptrdiff_t>(row - kSide / 2) * image.stride + column - kSide / 2;
  interpolate_across(pixels, a, upper);
  for (std::int32_t r = 0; r < kSide; ++r) {
    pixels += image.stride;
    interpolate_across(pixels, a, lower);
    for (std::int32_t c = 0; c < kSide; ++c) out[r * kSide + c] = upper[c] + b * (lower[c] - upper[c]);
    upper = lower;
  }
}

// Row by row, so that what hangs over at the end of a row is overwritten by the next one.
void sample_warped(const ImageView& image, float u_px, float v_px, const PatchWarp& warp, PatchSamples& out) {
  constexpr std::size_t kSteps = (kPatchSide_px + kLanes - 1) / kLanes;
  static_assert((kPatchSide_px - 1) * kPatchSide_px + kSteps * kLanes <= std::tuple_size_v<PatchSamples>);
  const Floats stride = cv::vx_setall_f32(static_cast<float>(image.stride));
  const Squares low = cv::vx_setall_u32(0xFF);
  const std::uint8_t* next_row = image.pixels + image.stride;
  std::array<Floats, kSteps> along_u;
  std::array<Floats, kSteps> along_v;
  for (std::size_t k = 0; k < kSteps; ++k) {
    const Floats x = columns_from(static_cast<std::int32_t>(k * kLanes));
    along_u[k] = cv::vx_setall_f32(warp[0]) * x;
    along_v[k] = cv::vx_setall_f32(warp[2]) * x;
  }
  for (std::int32_t r = 0; r < kPatchSide_px; ++r) {
    const auto y = static_cast<float>(r - kPatchHalf_px);
    const Floats row_u = cv::vx_setall_f32(u_px + warp[1] * y);
    const Floats row_v = cv::vx_setall_f32(v_px + warp[3] * y);
    for (std::size_t k = 0; k < kSteps; ++k) {
      const Floats u = row_u + along_u[k];
      const Floats v = row_v + along_v[k];
      const Floats column = cv::v_cvt_f32(cv::v_trunc(u));
      const Floats row = cv::v_cvt_f32(cv::v_trunc(v));
      std::array<std::int32_t, kLanes> offset;
      cv::v_store(offset.data(), cv::v_trunc(row * stride + column));  // exact: an image has fewer than 2^24 bytes
      const Squares all = squares_at(image.pixels, next_row, offset);
      const auto between = [a = u - column](const Squares& left_grey, const Squares& right_grey) {
        const Floats left = cv::v_cvt_f32(cv::v_reinterpret_as_s32(left_grey));
        return left + a * (cv::v_cvt_f32(cv::v_reinterpret_as_s32(right_grey)) - left);
      };
      const Floats upper = between(all & low, cv::v_shr<8>(all) & low);
      const Floats lower = between(cv::v_shr<16>(all) & low, cv::v_shr<24>(all));
      cv::v_store(&out[static_cast<std::size_t>(r) * kPatchSide_px + k * kLanes], upper + (v - row) * (lower - upper));
    }
  }
  std::fill(out.begin() + kPatchSamples, out.end(), 0.0F);
}

void remove_mean(PatchSamples& samples) {
  Parts parts{};
  for (std::size_t i = 0; i < samples.size(); i += kParts) {
    for (std::size_t k = 0; k < kParts; ++k) parts[k] += samples[i + k];
  }
  const float mean = total(parts) / static_cast<float>(kPatchSamples);
  for (std::size_t i = 0; i < kPatchSamples; ++i) samples[i] -= mean;
}

float dot(const PatchSamples& a, const PatchSamples& b) {
  Parts parts{};
  for (std::size_t i = 0; i < a.size(); i += kParts) {
    for (std::size_t k = 0; k < kParts; ++k) parts[k] += a[i + k] * b[i + k];
  }
  return total(parts);
}

std::array<float, 5> dots(const FivePatches& vectors, const PatchSamples& b) {
  std::array<std::array<Floats, kVectors>, std::tuple_size_v<FivePatches>> sums;
  for (auto& sum : sums) sum.fill(cv::vx_setzero_f32());
  for (std::size_t i = 0; i < b.size(); i += kParts) {
    for (std::size_t k = 0; k < kVectors; ++k) {
      const Floats factor = cv::vx_load(&b[i + k * kLanes]);
      for (std::size_t n = 0; n < sums.size(); ++n) {
        sums[n][k] = sums[n][k] + cv::vx_load(&(*vectors[n])[i + k * kLanes]) * factor;
      }
    }
  }
  std::array<float, 5> out;
  for (std::size_t n = 0; n < sums.size(); ++n) {
    Parts parts;
    for (std::size_t k = 0; k < kVectors; ++k) cv::v_store(&parts[k * kLanes], sums[n][k]);
    out[n] = total(parts);
  }
  return out;
}

}  // namespace plumb
