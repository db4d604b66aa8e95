#include "fsw/vision/patch_template.h"

#include <cmath>

namespace plumb {
namespace {

constexpr int kMaxIterations = 8;
constexpr float kConverged_px = 0.01F;
constexpr float kMinEnergy = 1.0F;       // grey levels squared per sample: flatter than sensor noise
constexpr float kMinEigenvalue = 10.0F;  // of the structure tensor per sample, (grey level / px)^2; measured

/// Bilinear interpolation. Precondition: the four pixels around the point are in the image.
float sample(const ImageView& image, float u_px, float v_px) {
  const auto column = static_cast<std::int32_t>(u_px);
  const auto row = static_cast<std::int32_t>(v_px);
  const float a = u_px - static_cast<float>(column);
  const float b = v_px - static_cast<float>(row);
  const std::uint8_t* above = image.pixels + static_cast<std::ptrdiff_t>(row) * image.stride + column;
  const std::uint8_t* below = above + image.stride;
  const float upper = static_cast<float>(above[0]) + a * (static_cast<float>(above[1]) - static_cast<float>(above[0]));
  const float lower = static_cast<float>(below[0]) + a * (static_cast<float>(below[1]) - static_cast<float>(below[0]));
  return upper + b * (lower - upper);
}

/// True when every point within reach of (u, v) can be interpolated. Also false when u or v is not a number.
bool covers(const ImageView& image, float u_px, float v_px, float reach_u_px, float reach_v_px) {
  return u_px - reach_u_px >= 0.0F && v_px - reach_v_px >= 0.0F &&
         u_px + reach_u_px < static_cast<float>(image.width - 1) &&
         v_px + reach_v_px < static_cast<float>(image.height - 1);
}

template <class Samples>
void remove_mean(Samples& samples) {
  float sum = 0.0F;
  for (const float s : samples) sum += s;
  const float mean = sum / static_cast<float>(samples.size());
  for (float& s : samples) s -= mean;
}

template <class Samples>
float dot(const Samples& a, const Samples& b) {
  float sum = 0.0F;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

}  // namespace

Status PatchTemplate::capture(const ImageView& image, float u_px, float v_px) {
  constexpr std::int32_t kReach_px = kHalf_px + 1;  // one more for the central differences
  constexpr std::int32_t kWide = kSide_px + 2;
  if (!covers(image, u_px, v_px, kReach_px, kReach_px)) return Status::kRejected;
  std::array<float, kWide * kWide> wide;
  for (std::int32_t r = 0; r < kWide; ++r) {
    for (std::int32_t c = 0; c < kWide; ++c) {
      wide[r * kWide + c] =
          sample(image, u_px + static_cast<float>(c - kReach_px), v_px + static_cast<float>(r - kReach_px));
    }
  }
  Samples value;
  Samples gradient_u;
  Samples gradient_v;
  for (std::int32_t r = 0; r < kSide_px; ++r) {
    for (std::int32_t c = 0; c < kSide_px; ++c) {
      const std::int32_t centre = (r + 1) * kWide + c + 1;
      value[r * kSide_px + c] = wide[centre];
      gradient_u[r * kSide_px + c] = 0.5F * (wide[centre + 1] - wide[centre - 1]);
      gradient_v[r * kSide_px + c] = 0.5F * (wide[centre + kWide] - wide[centre - kWide]);
    }
  }
  remove_mean(value);
  remove_mean(gradient_u);
  remove_mean(gradient_v);
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
  inverse_uu_ = vv / determinant;
  inverse_uv_ = -uv / determinant;
  inverse_vv_ = uu / determinant;
  energy_ = energy;
  return Status::kOk;
}

Status PatchTemplate::align(const ImageView& image, const Mat2& warp, PatchPosition& position) const {
  const Eigen::Matrix2f w = warp.cast<float>();
  constexpr auto kHalf = static_cast<float>(kHalf_px);
  const float reach_u_px = kHalf * (std::fabs(w(0, 0)) + std::fabs(w(0, 1)));
  const float reach_v_px = kHalf * (std::fabs(w(1, 0)) + std::fabs(w(1, 1)));
  Samples seen;
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    if (!covers(image, position.u_px, position.v_px, reach_u_px, reach_v_px)) return Status::kRejected;
    for (std::int32_t r = 0; r < kSide_px; ++r) {
      const auto y = static_cast<float>(r - kHalf_px);
      for (std::int32_t c = 0; c < kSide_px; ++c) {
        const auto x = static_cast<float>(c - kHalf_px);
        seen[r * kSide_px + c] =
            sample(image, position.u_px + w(0, 0) * x + w(0, 1) * y, position.v_px + w(1, 0) * x + w(1, 1) * y);
      }
    }
    remove_mean(seen);
    const float seen_energy = dot(seen, seen);
    if (!(seen_energy > kMinEnergy * kSamples)) return Status::kIllConditioned;
    const float common = dot(seen, value_);
    position.similarity = common / std::sqrt(seen_energy * energy_);
    // The gain that brings the seen patch nearest to the template. A negative one means another thing is seen.
    const float gain = common / seen_energy;
    if (!(gain > 0.0F)) return Status::kIllConditioned;
    const float along_u = gain * dot(gradient_u_, seen) - dot(gradient_u_, value_);
    const float along_v = gain * dot(gradient_v_, seen) - dot(gradient_v_, value_);
    // The image shows at offset x what the template has at x + step; so the feature is at minus the warped step.
    const float step_u = inverse_uu_ * along_u + inverse_uv_ * along_v;
    const float step_v = inverse_uv_ * along_u + inverse_vv_ * along_v;
    position.u_px -= w(0, 0) * step_u + w(0, 1) * step_v;
    position.v_px -= w(1, 0) * step_u + w(1, 1) * step_v;
    if (step_u * step_u + step_v * step_v < kConverged_px * kConverged_px) {
      return covers(image, position.u_px, position.v_px, 0.0F, 0.0F) ? Status::kOk : Status::kRejected;
    }
  }
  return Status::kIllConditioned;
}

}  // namespace plumb
