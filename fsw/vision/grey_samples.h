#pragma once
// Grey levels between the pixels of an image, many at once and as integers: what PatchFlow computes with.
//
// Samples are 16-bit integers: interpolated grey levels in 1/64, their differences and the gradients in 1/8 grey level
// (a gradient is the difference over two pixels). The sum of 21 * 21 products of the latter two stays below 2^31. The
// additions never saturate where that is said of their operands.

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
inline constexpr std::int16_t kScharr = 12288;                // 3/16 in 1/2^16: the outer weights of (3 10 3)/16

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
  const double column = std::floor(u_px);
  const double row = std::floor(v_px);
  constexpr double kOne = 1 << kWeightBits;
  GreyPlace place;
  place.stride = image.stride;
  place.column = static_cast<std::int32_t>(column);
  place.row = static_cast<std::int32_t>(row);
  place.pixels = image.pixels + place.row * place.stride + place.column;
  place.right = cv::vx_setall_s16(static_cast<std::int16_t>((u_px - column) * kOne));
  place.down = cv::vx_setall_s16(static_cast<std::int16_t>((v_px - row) * kOne));
  return place;
}

// What 64-bit ARM does in one instruction and the universal intrinsics do in up to six. All are exact on either path.
#if CV_NEON
/// Between neighbouring rows. 2 a b / 2^16, rounded down, is a times a weight.
inline GreySamples between(const GreySamples& upper, const GreySamples& lower, const GreySamples& down) {
  return upper + GreySamples(vqdmulhq_s16((lower - upper).val, down.val));
}
/// Between neighbouring columns [1/64 grey level].
inline GreySamples across(const std::uint8_t* pixels, const GreySamples& right) {
  const auto grey = [](const std::uint8_t* at) {
    return GreySamples(vreinterpretq_s16_u16(vshll_n_u8(vld1_u8(at), kGreyBits)));
  };
  return between(grey(pixels), grey(pixels + 1), right);
}
#else
inline GreySamples between(const GreySamples& upper, const GreySamples& lower, const GreySamples& down) {
  return upper + cv::v_mul_hi(cv::v_shl<1>(lower - upper), down);
}
inline GreySamples across(const std::uint8_t* pixels, const GreySamples& right) {
  const GreySamples here = cv::v_reinterpret_as_s16(cv::vx_load_expand(pixels));
  const GreySamples next = cv::v_reinterpret_as_s16(cv::vx_load_expand(pixels + 1));
  return cv::v_shl<kGreyBits>(here) + cv::v_mul_hi(cv::v_shl<kGreyBits + 1>(next - here), right);
}
#endif

/// Of three neighbours, with the weights (3 10 3)/16.
inline GreySamples scharr(const GreySamples& before, const GreySamples& at, const GreySamples& after) {
  return at + cv::v_mul_hi((before - at) + (after - at), cv::vx_setall_s16(kScharr));
}

/// From 1/64 to 1/8, rounded to the nearest.
inline GreySamples coarse(const GreySamples& fine) {
  return cv::v_shr<kDroppedBits>(fine + cv::vx_setall_s16(1 << (kDroppedBits - 1)));
}

}  // namespace plumb
