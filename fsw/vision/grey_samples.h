#pragma once
// Grey levels between the pixels of an image, many at once and as integers: what PatchFlow computes with.
//
// Samples are 16-bit integers: interpolated grey levels in 1/64, their differences and the gradients in 1/8 grey level
// (a gradient is the difference over two pixels). The sum of 21 * 21 products of the latter two stays below 2^31; also
// when a gradient has lost what it has in common with light, which makes the sum of its squares no larger. Additions
// saturate, on every machine alike, where gradients change by more than half of the grey levels at a pixel.

#include <cmath>
#include <cstddef>
#include <cstdint>

#include "fsw/measurement/samples.h"
#include "fsw/vision/tracker_options.h"
#include "fsw/vision/vector_types.h"

namespace plumb {

using GreySamples = cv::v_int16;
using GreySums = cv::v_int32;
inline constexpr std::size_t kGreyLanes = GreySamples::nlanes;

inline constexpr int kWeightBits = 15;                        // of the place between two pixels
inline constexpr int kGreyBits = 6;                           // of a sample
inline constexpr int kCoarseBits = 3;                         // of differences and gradients
inline constexpr int kDroppedBits = kGreyBits - kCoarseBits;  // from 1/64 to 1/8

inline constexpr std::int64_t kMaxGreyProduct = (255 << kCoarseBits) * (255 << kCoarseBits);
static_assert(TrackerOptions::kMaxWindow_px * TrackerOptions::kMaxWindow_px * kMaxGreyProduct <
              (std::int64_t{1} << 31));

/// A place in an image: the pixel at its upper left, and the rest.
struct GreyPlace {
  const std::uint8_t* pixels = nullptr;
  std::ptrdiff_t stride = 0;
  std::int32_t column = 0;  ///< of the pixel
  std::int32_t row = 0;
  GreySamples right;  ///< 1 / 2^kWeightBits px
  GreySamples down;
};

/// Precondition: the pixel is in the image or its margin.
inline GreyPlace place_at(const ImageView& image, double u_px, double v_px) {
  constexpr std::int32_t kOne = 1 << kWeightBits;
  const auto u = static_cast<std::int32_t>(std::floor(u_px * kOne));
  const auto v = static_cast<std::int32_t>(std::floor(v_px * kOne));
  GreyPlace place;
  place.stride = image.stride;
  place.column = u >> kWeightBits;
  place.row = v >> kWeightBits;
  place.pixels = image.pixels + place.row * place.stride + place.column;
  place.right = cv::vx_setall_s16(static_cast<std::int16_t>(u & (kOne - 1)));
  place.down = cv::vx_setall_s16(static_cast<std::int16_t>(v & (kOne - 1)));
  return place;
}

// What 64-bit ARM does in one instruction and the universal intrinsics do in up to six. All give the same bits on
// either path.
#if CV_NEON
/// a * weight / 2^kWeightBits, rounded down. Precondition: |a| below 2^14.
inline GreySamples weighted(const GreySamples& a, const GreySamples& weight) {
  return GreySamples(vqdmulhq_s16(a.val, weight.val));
}
/// 1/64 grey level.
inline GreySamples grey_at(const std::uint8_t* pixels) {
  return GreySamples(vreinterpretq_s16_u16(vshll_n_u8(vld1_u8(pixels), kGreyBits)));
}
/// 3/16 a, rounded down.
inline GreySamples three_sixteenths(const GreySamples& a) { return GreySamples(vqdmulhq_n_s16(a.val, 6144)); }
inline GreySums sum_with(const GreySums& sum, const GreySamples& a) { return GreySums(vpadalq_s16(sum.val, a.val)); }
#else
inline GreySamples weighted(const GreySamples& a, const GreySamples& weight) {
  return cv::v_mul_hi(cv::v_shl<1>(a), weight);
}
inline GreySamples grey_at(const std::uint8_t* pixels) {
  return cv::v_shl<kGreyBits>(cv::v_reinterpret_as_s16(cv::vx_load_expand(pixels)));
}
inline GreySamples three_sixteenths(const GreySamples& a) { return cv::v_mul_hi(a, cv::vx_setall_s16(12288)); }
inline GreySums sum_with(const GreySums& sum, const GreySamples& a) {
  return cv::v_dotprod_fast(a, cv::vx_setall_s16(1), sum);
}
#endif

/// Between neighbouring rows.
inline GreySamples between(const GreySamples& upper, const GreySamples& lower, const GreySamples& down) {
  return upper + weighted(lower - upper, down);
}
/// Between neighbouring columns [1/64 grey level].
inline GreySamples across(const std::uint8_t* pixels, const GreySamples& right) {
  return between(grey_at(pixels), grey_at(pixels + 1), right);
}
/// Calls take(r, samples) for each of `rows` rows of the place, of which the first begins at the pixel `first`. What
/// `take` reads alone it had better hold by value: it is then not read again for every row.
template <class Take>
inline void for_each_row(const GreyPlace& place, const std::uint8_t* first, std::int32_t rows, Take take) {
  GreySamples upper = across(first, place.right);
  for (std::int32_t r = 0; r < rows; ++r) {
    const GreySamples lower = across(first + (r + 1) * place.stride, place.right);
    take(r, between(upper, lower, place.down));
    upper = lower;
  }
}
/// Of three neighbours, with the weights (3 10 3)/16.
inline GreySamples scharr(const GreySamples& before, const GreySamples& at, const GreySamples& after) {
  return at + three_sixteenths((before - at) + (after - at));
}

/// From 1/64 to 1/8, rounded to the nearest.
inline GreySamples coarse(const GreySamples& fine) {
  return cv::v_shr<kDroppedBits>(fine + cv::vx_setall_s16(1 << (kDroppedBits - 1)));
}

}  // namespace plumb
