#include "fsw/vision/patch_flow.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "fsw/base/assert.h"
#include "fsw/vision/flow_patch.h"
#include "fsw/vision/grey_samples.h"

namespace plumb {
namespace {

constexpr double kTensorScale = 256.0;    // (16)^2: a gradient in 1/8 grey level over two pixels
constexpr double kStepScale = 2.0;        // differences times gradients over gradients squared: 8 * 16 in 16^2
constexpr double kOpenCvTensor = 1024.0;  // (grey levels / px)^2 per unit of TrackerOptions::min_eigenvalue
constexpr double kCoarseEpsilons = 5.0;   // on a coarse level: twice that, in px of the next one, is soon found there
constexpr double kOscillation_px = 0.01;  // two steps that cancel to less than that go on for ever

constexpr std::int32_t kMaxSide = TrackerOptions::kMaxWindow_px;
constexpr std::size_t kMaxColumns = (kMaxSide + 2 + kGreyLanes - 1) / kGreyLanes * kGreyLanes;
static_assert(kMaxColumns < kImageMargin_px - 2);
constexpr std::int32_t kNarrow = 16;
static_assert(kNarrow % kGreyLanes == 0);
/// Whether a patch and its neighbours fit in rows of kNarrow columns.
bool is_narrow(std::int32_t side) { return side + 2 <= kNarrow; }

/// Whether a patch with this upper left corner has a pixel of the image, beyond which there is only the margin. False
/// when a coordinate is not a number.
bool touches(const ImageView& image, std::int32_t side, double u_px, double v_px) {
  return u_px > -side && v_px > -side && u_px < image.width && v_px < image.height;
}

/// Sums of the difference of the images times the gradients of the patch.
struct Slope {
  std::int64_t u = 0;
  std::int64_t v = 0;
};

template <std::size_t Columns>
Slope slope_at(const GreyPlace& place, std::int32_t side, const FlowPatch<Columns>& patch) {
  GreySums u = cv::vx_setzero_s32();
  GreySums v = cv::vx_setzero_s32();
  for (std::size_t c = 0; c < Columns; c += kGreyLanes) {
    for_each_row(place, place.pixels + c, side, [&](std::int32_t r, const GreySamples& seen) {
      const GreySamples difference = coarse(seen - cv::vx_load(&patch.value[r][c]));
      u = cv::v_dotprod_fast(difference, cv::vx_load(&patch.gradient_u[r][c]), u);
      v = cv::v_dotprod_fast(difference, cv::vx_load(&patch.gradient_v[r][c]), v);
    });
  }
  return {cv::v_reduce_sum(u), cv::v_reduce_sum(v)};
}

/// Sums over the pixels of two patches, of grey levels above the middle.
struct PairSums {
  GreySums a = cv::vx_setzero_s32();  ///< 1/64 grey level
  GreySums b = cv::vx_setzero_s32();
  GreySums ab = cv::vx_setzero_s32();  ///< of coarse ones
  GreySums bb = cv::vx_setzero_s32();
};

/// The same piece of wall in two images.
template <std::size_t Columns>
class PatchPair {
 public:
  PatchPair(const GreyPlace& a, const GreyPlace& b, std::int32_t side) : side_(side) {
    for (std::int32_t c = 0; c < side; ++c) inside_[static_cast<std::size_t>(c)] = -1;
    for (std::size_t c = 0; c < Columns; c += kGreyLanes) {
      take(a, c, a_);
      take(b, c, b_);
    }
  }
  /// Mean absolute difference [1/64 grey level].
  double difference(bool light_change) const {
    return light_change ? difference_in(light_between()) : difference_in(Light{});
  }

 private:
  using Block = typename FlowPatch<Columns>::Block;
  void take(const GreyPlace& place, std::size_t column, Block& block) const {
    const GreySamples middle = cv::vx_setall_s16(128 << kGreyBits);
    const GreySamples inside = cv::vx_load(&inside_[column]);
    for_each_row(place, place.pixels + column, side_,
                 [&block, column, middle, inside](std::int32_t r, const GreySamples& seen) {
                   cv::v_store(&block[r][column], (seen - middle) & inside);
                 });
  }
  /// What makes the second patch most like the first.
  struct Light {
    GreySamples mean_a = cv::vx_setzero_s16();  ///< 1/64 grey level
    GreySamples mean_b = cv::vx_setzero_s16();
    GreySamples more = cv::vx_setzero_s16();  ///< by which the gain is above 1 [1/2^15]
  };
  PairSums sums() const;
  Light light_between() const;
  double difference_in(const Light& light) const;

  std::int32_t side_;
  typename FlowPatch<Columns>::Row inside_{};
  Block a_;
  Block b_;
};

template <std::size_t Columns>
PairSums PatchPair<Columns>::sums() const {
  PairSums sums;
  for (std::int32_t r = 0; r < side_; ++r) {
    for (std::size_t c = 0; c < Columns; c += kGreyLanes) {
      const GreySamples a = cv::vx_load(&a_[r][c]);
      const GreySamples b = cv::vx_load(&b_[r][c]);
      sums.a = sum_with(sums.a, a);
      sums.b = sum_with(sums.b, b);
      sums.ab = cv::v_dotprod_fast(coarse(a), coarse(b), sums.ab);
      sums.bb = cv::v_dotprod_fast(coarse(b), coarse(b), sums.bb);
    }
  }
  return sums;
}

template <std::size_t Columns>
typename PatchPair<Columns>::Light PatchPair<Columns>::light_between() const {
  constexpr double kScale = 1 << 15;
  constexpr double kLeast = -0.5 * kScale;  // what changes by more than a factor of two is not the light
  constexpr double kMost = kScale - 1.0;
  constexpr double kCoarse2 = (1 << kDroppedBits) * (1 << kDroppedBits);
  const double count = side_ * side_;
  const PairSums sum = sums();
  const double mean_a = cv::v_reduce_sum(sum.a) / count;
  const double mean_b = cv::v_reduce_sum(sum.b) / count;
  const double bb = kCoarse2 * cv::v_reduce_sum(sum.bb) / count - mean_b * mean_b;
  const double ab = kCoarse2 * cv::v_reduce_sum(sum.ab) / count - mean_a * mean_b;
  const double more = bb > 0.0 ? std::clamp(kScale * (ab / bb - 1.0), kLeast, kMost) : 0.0;
  const auto nearest = [](double x) { return cv::vx_setall_s16(static_cast<std::int16_t>(std::floor(x + 0.5))); };
  return {nearest(mean_a), nearest(mean_b), nearest(more)};
}

template <std::size_t Columns>
double PatchPair<Columns>::difference_in(const Light& light) const {
  GreySums sum = cv::vx_setzero_s32();
  for (std::int32_t r = 0; r < side_; ++r) {
    for (std::size_t c = 0; c < Columns; c += kGreyLanes) {
      const GreySamples a = cv::vx_load(&a_[r][c]) - light.mean_a;
      const GreySamples b = cv::vx_load(&b_[r][c]) - light.mean_b;
      const GreySamples lit = b + weighted(b, light.more);
      sum = sum_with(sum, cv::v_absdiffs(a, lit) & cv::vx_load(&inside_[c]));
    }
  }
  return static_cast<double>(cv::v_reduce_sum(sum)) / (side_ * side_);
}

}  // namespace

PatchFlow::PatchFlow(const TrackerOptions& options)
    : window_px_(options.window_px),
      max_iterations_(options.max_iterations),
      light_change_(options.light_change),
      epsilon_px_(options.epsilon_px),
      min_eigenvalue_(static_cast<std::int64_t>(
          std::ceil(options.min_eigenvalue * kOpenCvTensor * kTensorScale * options.window_px * options.window_px))) {
  PLUMB_ASSERT(window_px_ >= 1 && window_px_ <= kMaxSide && window_px_ % 2 == 1);
}

template <std::size_t Columns>
void PatchFlow::refine_with(const ImageView& from, const ImageView& to, double last_step_px, FlowPoint& point) const {
  const double half_px = (window_px_ - 1) / 2;
  const double from_u_px = static_cast<double>(point.from_u_px) - half_px;
  const double from_v_px = static_cast<double>(point.from_v_px) - half_px;
  point.found = false;
  if (!touches(from, window_px_, from_u_px, from_v_px)) return;
  FlowPatch<Columns> patch;
  patch.take(from, window_px_, place_at(from, from_u_px, from_v_px), light_change_);
  const GradientTensor tensor = patch.tensor;
  if (!tensor.reaches(min_eigenvalue_)) return;
  const auto determinant = static_cast<double>(tensor.determinant());
  double u_px = static_cast<double>(point.to_u_px) - half_px;
  double v_px = static_cast<double>(point.to_v_px) - half_px;
  double last_u_px = 1.0;
  double last_v_px = 1.0;
  for (std::int32_t i = 0; i < max_iterations_ && touches(to, window_px_, u_px, v_px); ++i) {
    const Slope slope = slope_at(place_at(to, u_px, v_px), window_px_, patch);
    double step_u_px = kStepScale * static_cast<double>(tensor.uv * slope.v - tensor.vv * slope.u) / determinant;
    double step_v_px = kStepScale * static_cast<double>(tensor.uv * slope.u - tensor.uu * slope.v) / determinant;
    const bool oscillates =
        std::fabs(step_u_px + last_u_px) < kOscillation_px && std::fabs(step_v_px + last_v_px) < kOscillation_px;
    if (oscillates) {
      step_u_px *= 0.5;
      step_v_px *= 0.5;
    }
    u_px += step_u_px;
    v_px += step_v_px;
    last_u_px = step_u_px;
    last_v_px = step_v_px;
    if (oscillates || step_u_px * step_u_px + step_v_px * step_v_px <= last_step_px * last_step_px) break;
  }
  point.to_u_px = static_cast<float>(u_px + half_px);
  point.to_v_px = static_cast<float>(v_px + half_px);
  point.found = touches(to, window_px_, u_px, v_px);
}

void PatchFlow::refine(const ImageView& from, const ImageView& to, bool finest, FlowPoint& point) const {
  const double last_step_px = finest ? epsilon_px_ : kCoarseEpsilons * epsilon_px_;
  if (is_narrow(window_px_)) {
    refine_with<kNarrow>(from, to, last_step_px, point);
  } else {
    refine_with<kMaxColumns>(from, to, last_step_px, point);
  }
}

float PatchFlow::residual(const ImageView& from, const ImageView& to, const FlowPoint& point) const {
  const double half_px = (window_px_ - 1) / 2;
  const GreyPlace first =
      place_at(from, static_cast<double>(point.from_u_px) - half_px, static_cast<double>(point.from_v_px) - half_px);
  const GreyPlace second =
      place_at(to, static_cast<double>(point.to_u_px) - half_px, static_cast<double>(point.to_v_px) - half_px);
  const double difference = is_narrow(window_px_)
                                ? PatchPair<kNarrow>(first, second, window_px_).difference(light_change_)
                                : PatchPair<kMaxColumns>(first, second, window_px_).difference(light_change_);
  return static_cast<float>(difference / (1 << kGreyBits));
}

}  // namespace plumb
