#pragma once
// What PatchTemplate computes of the samples of a patch, all of them at once: grey levels between the pixels, sums and
// products. Sums are taken over eight interleaved parts, in one order on every machine, so that vector units of any
// width give the same bits.

#include <array>
#include <cstddef>
#include <cstdint>

#include "fsw/measurement/samples.h"

namespace plumb {

inline constexpr std::int32_t kPatchHalf_px = 6;
inline constexpr std::int32_t kPatchSide_px = 2 * kPatchHalf_px + 1;
inline constexpr std::int32_t kPatchSamples = kPatchSide_px * kPatchSide_px;

/// Row by row, without a gap; in whole vectors, what is behind the last being zero, which counts for nothing.
using PatchSamples = std::array<float, (kPatchSamples + 7) / 8 * 8>;

/// A patch and one sample more on each side.
inline constexpr std::int32_t kWidePatchSide_px = kPatchSide_px + 2;
using WidePatchSamples = std::array<float, kWidePatchSide_px * kWidePatchSide_px>;

/// The image at a grid of one px around a point [grey levels]. Precondition: every point of the grid can be
/// interpolated.
void sample_wide(const ImageView& image, float u_px, float v_px, WidePatchSamples& out);

/// What an offset from the centre of the patch becomes in the image, row by row.
using PatchWarp = std::array<float, 4>;
/// The same at a grid that is warped.
void sample_warped(const ImageView& image, float u_px, float v_px, const PatchWarp& warp, PatchSamples& out);

void remove_mean(PatchSamples& samples);

float dot(const PatchSamples& a, const PatchSamples& b);
/// Five dot products with one and the same vector in one pass, each summed as dot() does.
using FivePatches = std::array<const PatchSamples*, 5>;
std::array<float, 5> dots(const FivePatches& vectors, const PatchSamples& b);

}  // namespace plumb
