#include "fsw/vision/patch_template.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <opencv2/core/hal/intrin.hpp>
#include <tuple>

namespace plumb {
namespace {

constexpr int kMaxIterations = 12;
constexpr float kConverged_px = 0.02F;
constexpr float kMinEnergy = 1.0F;       // grey levels squared per sample: flatter than sensor noise
constexpr float kScalePrior = 100.0F;    // (grey level)^2 per sample
constexpr float kMaxScale = 1.6F;        // beyond it, up or down, the patch has too few samples of the image
constexpr float kMinEigenvalue = 10.0F;  // of the structure tensor per sample, (grey level / px)^2; measured

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

/// True when every point within reach of (u, v) can be interpolated. Also false when u or v is not a number.
bool covers(const ImageView& image, float u_px, float v_px, float reach_u_px, float reach_v_px) {
  return u_px - reach_u_px >= 0.0F && v_px - reach_v_px >= 0.0F &&
         u_px + reach_u_px < static_cast<float>(image.width - 1) &&
         v_px + reach_v_px < static_cast<float>(image.height - 1);
}

// Sums are taken over eight interleaved parts, in one order on every machine, so that vector units can be used.
constexpr std::size_t kParts = 8;
using Parts = std::array<float, kParts>;

float total(const Parts& parts) {
  return ((parts[0] + parts[4]) + (parts[2] + parts[6])) + ((parts[1] + parts[5]) + (parts[3] + parts[7]));
}

/// Samples of the image at a grid of one px around a point, unturned: all lie between their pixels alike. Precondition:
/// every point of the grid can be interpolated.
template <std::int32_t Side>
void sample_square(const ImageView& image, float u_px, float v_px, std::array<float, Side * Side>& out) {
  const auto column = static_cast<std::int32_t>(u_px);
  const auto row = static_cast<std::int32_t>(v_px);
  const float a = u_px - static_cast<float>(column);
  const float b = v_px - static_cast<float>(row);
  std::array<float, Side> upper;
  std::array<float, Side> lower;
  const std::uint8_t* pixels =
      image.pixels + static_cast<std::ptrdiff_t>(row - Side / 2) * image.stride + column - Side / 2;
  interpolate_across(pixels, a, upper);
  for (std::int32_t r = 0; r < Side; ++r) {
    pixels += image.stride;
    interpolate_across(pixels, a, lower);
    for (std::int32_t c = 0; c < Side; ++c) out[r * Side + c] = upper[c] + b * (lower[c] - upper[c]);
    upper = lower;
  }
}

/// Samples of the image at a grid of one px around a point, warped: row by row, without a gap. Writes up to three more
/// behind the last. Precondition: every point of the grid can be interpolated.
template <class Samples>
void sample_grid(const ImageView& image, float u_px, float v_px, const Eigen::Matrix2f& warp, Samples& out) {
  using Floats = cv::v_float32x4;
  using Squares = cv::v_uint32x4;
  constexpr auto kLast = static_cast<float>(PatchTemplate::kHalf_px);
  const Floats stride = cv::v_setall_f32(static_cast<float>(image.stride));
  const std::uint8_t* next_row = image.pixels + image.stride;
  for (std::int32_t r = 0; r < PatchTemplate::kSide_px; ++r) {
    const auto y = static_cast<float>(r - PatchTemplate::kHalf_px);
    const Floats row_u = cv::v_setall_f32(u_px + warp(0, 1) * y);
    const Floats row_v = cv::v_setall_f32(v_px + warp(1, 1) * y);
    for (std::int32_t c = 0; c < PatchTemplate::kSide_px; c += Floats::nlanes) {
      const auto first = static_cast<float>(c - PatchTemplate::kHalf_px);
      // What hangs over at the end of the row stays in the patch.
      const Floats x = cv::v_min(Floats(first, first + 1.0F, first + 2.0F, first + 3.0F), cv::v_setall_f32(kLast));
      const Floats u = row_u + cv::v_setall_f32(warp(0, 0)) * x;
      const Floats v = row_v + cv::v_setall_f32(warp(1, 0)) * x;
      const Floats column = cv::v_cvt_f32(cv::v_trunc(u));
      const Floats row = cv::v_cvt_f32(cv::v_trunc(v));
      std::array<std::int32_t, Floats::nlanes> offset;
      cv::v_store(offset.data(), cv::v_trunc(row * stride + column));  // exact: an image has fewer than 2^24 bytes
      // The four neighbours of each, from the upper left in the low byte on.
      const auto upper_pair = [&](std::size_t i) { return pair_at(image.pixels + offset[i]); };
      const auto lower_pair = [&](std::size_t i) { return pair_at(next_row + offset[i]); };
      const Squares all =
          cv::v_reinterpret_as_u32(cv::v_uint16x8(upper_pair(0), lower_pair(0), upper_pair(1), lower_pair(1),
                                                  upper_pair(2), lower_pair(2), upper_pair(3), lower_pair(3)));
      const Squares low = cv::v_setall_u32(0xFF);
      const auto between = [a = u - column](const Squares& left_grey, const Squares& right_grey) {
        const Floats left = cv::v_cvt_f32(cv::v_reinterpret_as_s32(left_grey));
        return left + a * (cv::v_cvt_f32(cv::v_reinterpret_as_s32(right_grey)) - left);
      };
      const Floats upper = between(all & low, cv::v_shr<8>(all) & low);
      const Floats lower = between(cv::v_shr<16>(all) & low, cv::v_shr<24>(all));
      cv::v_store(&out[static_cast<std::size_t>(r * PatchTemplate::kSide_px + c)], upper + (v - row) * (lower - upper));
    }
  }
}

template <class Samples>
float dot(const Samples& a, const Samples& b) {
  Parts parts{};
  for (std::size_t i = 0; i < a.size(); i += kParts) {
    for (std::size_t k = 0; k < kParts; ++k) parts[k] += a[i + k] * b[i + k];
  }
  return total(parts);
}

/// Dot products with one and the same vector: `count` of them in one pass, each summed as dot() does.
template <class Samples, std::size_t Count>
std::array<float, Count> dots(const std::array<const Samples*, Count>& vectors, const Samples& b) {
  using Floats = cv::v_float32x4;
  static_assert(kParts == 2 * Floats::nlanes);
  std::array<Floats, Count> low;
  std::array<Floats, Count> high;
  low.fill(cv::v_setzero_f32());
  high.fill(cv::v_setzero_f32());
  for (std::size_t i = 0; i < b.size(); i += kParts) {
    const Floats b_low = cv::v_load(&b[i]);
    const Floats b_high = cv::v_load(&b[i + Floats::nlanes]);
    for (std::size_t n = 0; n < Count; ++n) {
      low[n] = low[n] + cv::v_load(&(*vectors[n])[i]) * b_low;
      high[n] = high[n] + cv::v_load(&(*vectors[n])[i + Floats::nlanes]) * b_high;
    }
  }
  std::array<float, Count> sums;
  for (std::size_t n = 0; n < Count; ++n) {
    Parts parts;
    cv::v_store(parts.data(), low[n]);
    cv::v_store(&parts[Floats::nlanes], high[n]);
    sums[n] = total(parts);
  }
  return sums;
}

template <class Samples>
void remove_mean(Samples& samples) {
  Parts parts{};
  for (std::size_t i = 0; i < samples.size(); i += kParts) {
    for (std::size_t k = 0; k < kParts; ++k) parts[k] += samples[i + k];
  }
  const float mean = total(parts) / static_cast<float>(PatchTemplate::kSamples);
  for (std::size_t i = 0; i < PatchTemplate::kSamples; ++i) samples[i] -= mean;
}

}  // namespace

Status PatchTemplate::capture(const ImageView& image, float u_px, float v_px) {
  constexpr std::int32_t kReach_px = kHalf_px + 1;  // one more for the central differences
  constexpr std::int32_t kWide = kSide_px + 2;
  if (!covers(image, u_px, v_px, kReach_px, kReach_px)) return Status::kRejected;
  std::array<float, kWide * kWide> wide;
  sample_square<kWide>(image, u_px, v_px, wide);
  Samples value{};
  Samples gradient_u{};
  Samples gradient_v{};
  Samples gradient_s{};
  for (std::int32_t r = 0; r < kSide_px; ++r) {
    for (std::int32_t c = 0; c < kSide_px; ++c) {
      const std::int32_t centre = (r + 1) * kWide + c + 1;
      const std::int32_t i = r * kSide_px + c;
      value[i] = wide[centre];
      gradient_u[i] = 0.5F * (wide[centre + 1] - wide[centre - 1]);
      gradient_v[i] = 0.5F * (wide[centre + kWide] - wide[centre - kWide]);
      gradient_s[i] =
          static_cast<float>(c - kHalf_px) * gradient_u[i] + static_cast<float>(r - kHalf_px) * gradient_v[i];
    }
  }
  remove_mean(value);
  remove_mean(gradient_u);
  remove_mean(gradient_v);
  remove_mean(gradient_s);
  const float uu = dot(gradient_u, gradient_u);
  const float uv = dot(gradient_u, gradient_v);
  const float vv = dot(gradient_v, gradient_v);
  const float half_trace = 0.5F * (uu + vv);
  const float determinant = uu * vv - uv * uv;
  const float smaller = half_trace - std::sqrt(std::fmax(half_trace * half_trace - determinant, 0.0F));
  const float energy = dot(value, value);
  if (!(energy > kMinEnergy * kSamples) || !(smaller > kMinEigenvalue * kSamples)) return Status::kIllConditioned;
  value_ = value;
  gradient_u_ = gradient_u;
  gradient_v_ = gradient_v;
  gradient_s_ = gradient_s;
  const float us = dot(gradient_u, gradient_s);
  const float vs = dot(gradient_v, gradient_s);
  // The scale of a patch like a straight fan is not seen; the prior then leaves it alone.
  const float ss = dot(gradient_s, gradient_s) + kScalePrior * kSamples;
  Eigen::Matrix3f tensor;
  tensor << uu, uv, us, uv, vv, vs, us, vs, ss;
  inverse_tensor_ = tensor.inverse();
  slope_ = Eigen::Vector3f(dot(gradient_u, value), dot(gradient_v, value), dot(gradient_s, value));
  energy_ = energy;
  return Status::kOk;
}

Status PatchTemplate::align(const ImageView& image, const Mat2& warp, PatchPosition& position) const {
  const Eigen::Matrix2f unscaled = warp.cast<float>();
  constexpr auto kHalf = static_cast<float>(kHalf_px);
  static_assert(std::tuple_size_v<Samples> >= kSamples + 3);
  Samples seen;
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    const Eigen::Matrix2f w = position.scale * unscaled;
    const float reach_u_px = kHalf * (std::fabs(w(0, 0)) + std::fabs(w(0, 1)));
    const float reach_v_px = kHalf * (std::fabs(w(1, 0)) + std::fabs(w(1, 1)));
    if (!covers(image, position.u_px, position.v_px, reach_u_px, reach_v_px)) return Status::kRejected;
    sample_grid(image, position.u_px, position.v_px, w, seen);
    std::fill(seen.begin() + kSamples, seen.end(), 0.0F);
    remove_mean(seen);
    const auto [seen_energy, common, slope_u, slope_v, slope_s] =
        dots<Samples, 5>({&seen, &value_, &gradient_u_, &gradient_v_, &gradient_s_}, seen);
    if (!(seen_energy > kMinEnergy * kSamples)) return Status::kIllConditioned;
    position.similarity = common / std::sqrt(seen_energy * energy_);
    // The gain that brings the seen patch nearest to the template. A negative one means another thing is seen.
    const float gain = common / seen_energy;
    if (!(gain > 0.0F)) return Status::kIllConditioned;
    const Eigen::Vector3f slope(slope_u, slope_v, slope_s);
    const Eigen::Vector3f step = inverse_tensor_ * (gain * slope - slope_);
    // The image shows at x what the template has at (1 + step_s) x + step_uv: undo that in the warp.
    const float growth = 1.0F + step.z();
    if (!(growth > 0.5F && growth < 2.0F)) return Status::kIllConditioned;
    position.scale /= growth;
    if (position.scale > kMaxScale || position.scale < 1.0F / kMaxScale) return Status::kRejected;
    const Eigen::Vector2f move = position.scale * (unscaled * step.head<2>());
    position.u_px -= move.x();
    position.v_px -= move.y();
    if (step.head<2>().squaredNorm() < kConverged_px * kConverged_px &&
        std::fabs(step.z()) * kHalf < kConverged_px * 4.0F) {
      return covers(image, position.u_px, position.v_px, 0.0F, 0.0F) ? Status::kOk : Status::kRejected;
    }
  }
  return Status::kIllConditioned;
}

}  // namespace plumb
