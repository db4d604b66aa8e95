#include "fsw/vision/patch_template.h"

#include <cmath>

namespace plumb {
namespace {

constexpr int kMaxIterations = 12;
constexpr float kConverged_px = 0.02F;
constexpr float kMinEnergy = 1.0F;       // grey levels squared per sample: flatter than sensor noise
constexpr float kScalePrior = 100.0F;    // (grey level)^2 per sample
constexpr float kMaxScale = 1.6F;        // beyond it, up or down, the patch has too few samples of the image
constexpr float kMinEigenvalue = 10.0F;  // of the structure tensor per sample, (grey level / px)^2; measured

/// True when every point within reach of (u, v) can be interpolated. Also false when u or v is not a number.
bool covers(const ImageView& image, float u_px, float v_px, float reach_u_px, float reach_v_px) {
  return u_px - reach_u_px >= 0.0F && v_px - reach_v_px >= 0.0F &&
         u_px + reach_u_px < static_cast<float>(image.width - 1) &&
         v_px + reach_v_px < static_cast<float>(image.height - 1);
}

}  // namespace

Status PatchTemplate::capture(const ImageView& image, float u_px, float v_px) {
  constexpr std::int32_t kReach_px = kPatchHalf_px + 1;  // one more for the central differences
  constexpr std::int32_t kWide = kWidePatchSide_px;
  if (!covers(image, u_px, v_px, kReach_px, kReach_px)) return Status::kRejected;
  WidePatchSamples wide;
  sample_wide(image, u_px, v_px, wide);
  PatchSamples value{};
  PatchSamples gradient_u{};
  PatchSamples gradient_v{};
  PatchSamples gradient_s{};
  for (std::int32_t r = 0; r < kPatchSide_px; ++r) {
    for (std::int32_t c = 0; c < kPatchSide_px; ++c) {
      const std::int32_t centre = (r + 1) * kWide + c + 1;
      const std::int32_t i = r * kPatchSide_px + c;
      value[i] = wide[centre];
      gradient_u[i] = 0.5F * (wide[centre + 1] - wide[centre - 1]);
      gradient_v[i] = 0.5F * (wide[centre + kWide] - wide[centre - kWide]);
      gradient_s[i] =
          static_cast<float>(c - kPatchHalf_px) * gradient_u[i] + static_cast<float>(r - kPatchHalf_px) * gradient_v[i];
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
  if (!(energy > kMinEnergy * kPatchSamples) || !(smaller > kMinEigenvalue * kPatchSamples))
    return Status::kIllConditioned;
  value_ = value;
  gradient_u_ = gradient_u;
  gradient_v_ = gradient_v;
  gradient_s_ = gradient_s;
  const float us = dot(gradient_u, gradient_s);
  const float vs = dot(gradient_v, gradient_s);
  // The scale of a patch like a straight fan is not seen; the prior then leaves it alone.
  const float ss = dot(gradient_s, gradient_s) + kScalePrior * kPatchSamples;
  Eigen::Matrix3f tensor;
  tensor << uu, uv, us, uv, vv, vs, us, vs, ss;
  inverse_tensor_ = tensor.inverse();
  slope_ = Eigen::Vector3f(dot(gradient_u, value), dot(gradient_v, value), dot(gradient_s, value));
  energy_ = energy;
  return Status::kOk;
}

Status PatchTemplate::align(const ImageView& image, const Mat2& warp, PatchPosition& position) const {
  const Eigen::Matrix2f unscaled = warp.cast<float>();
  constexpr auto kHalf = static_cast<float>(kPatchHalf_px);
  PatchSamples seen;
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    const Eigen::Matrix2f w = position.scale * unscaled;
    const float reach_u_px = kHalf * (std::fabs(w(0, 0)) + std::fabs(w(0, 1)));
    const float reach_v_px = kHalf * (std::fabs(w(1, 0)) + std::fabs(w(1, 1)));
    if (!covers(image, position.u_px, position.v_px, reach_u_px, reach_v_px)) return Status::kRejected;
    sample_warped(image, position.u_px, position.v_px, {w(0, 0), w(0, 1), w(1, 0), w(1, 1)}, seen);
    remove_mean(seen);
    const auto [seen_energy, common, slope_u, slope_v, slope_s] =
        dots({&seen, &value_, &gradient_u_, &gradient_v_, &gradient_s_}, seen);
    if (!(seen_energy > kMinEnergy * kPatchSamples)) return Status::kIllConditioned;
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
