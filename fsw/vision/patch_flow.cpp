#include "fsw/vision/patch_flow.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "fsw/base/assert.h"
#include "fsw/vision/vector_types.h"

namespace plumb {
namespace {

// Samples are 16-bit integers: interpolated grey levels in 1/64, their differences and the gradients in 1/8 grey level
// (a gradient is the difference over two pixels). The sum of 21 * 21 products of the latter two stays below 2^31. The
// additions never saturate.
using Samples = cv::v_int16;
using Sums = cv::v_int32;
constexpr std::size_t kLanes = Samples::nlanes;

constexpr int kWeightBits = 15;           // of the place between two pixels
constexpr int kGreyBits = 6;              // of a sample
constexpr int kCoarseBits = 3;            // of differences and gradients
constexpr std::int16_t kScharr = 12288;   // 3/16 in 1/2^16: the outer weights of (3 10 3)/16
constexpr double kTensorScale = 256.0;    // (16)^2: a gradient in 1/8 grey level over two pixels
constexpr double kStepScale = 2.0;        // differences times gradients over gradients squared: 8 * 16 in 16^2
constexpr double kOpenCvTensor = 1024.0;  // (grey levels / px)^2 per unit of TrackerOptions::min_eigenvalue
constexpr double kOscillation_px = 0.01;  // two steps that cancel to less than that go on for ever

constexpr std::int32_t kMaxSide = TrackerOptions::kMaxWindow_px;
/// A row of the patch with a neighbour on each side, in whole vectors.
constexpr std::size_t columns_of(std::size_t side) { return (side + 2 + kLanes - 1) / kLanes * kLanes; }
constexpr std::size_t kMaxColumns = columns_of(kMaxSide);
static_assert(kMaxColumns < kImageMargin_px - 2);
constexpr std::int64_t kMaxProduct = (255 << kCoarseBits) * (255 << kCoarseBits);
static_assert(kMaxSide * kMaxSide * kMaxProduct < (std::int64_t{1} << 31));

/// A place in an image: the pixel at its upper left, and the rest.
struct Place {
  const std::uint8_t* pixels = nullptr;
  std::ptrdiff_t stride = 0;
  std::int32_t column = 0;  ///< of the pixel
  std::int32_t row = 0;
  Samples right;  ///< 1 / 2^kWeightBits px
  Samples down;
};

/// Whether a patch with this upper left corner has a pixel of the image, beyond which there is only the margin. False
/// when a coordinate is not a number.
bool touches(const ImageView& image, std::int32_t side, double u_px, double v_px) {
  return u_px >= -side && v_px >= -side && u_px < image.width && v_px < image.height;
}

/// Precondition: touches().
Place place_at(const ImageView& image, double u_px, double v_px) {
  const double column = std::floor(u_px);
  const double row = std::floor(v_px);
  constexpr double kOne = 1 << kWeightBits;
  Place place;
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
Samples between(const Samples& upper, const Samples& lower, const Samples& down) {
  return upper + Samples(vqdmulhq_s16((lower - upper).val, down.val));
}
/// Between neighbouring columns [1/64 grey level].
Samples across(const std::uint8_t* pixels, const Samples& right) {
  const auto grey = [](const std::uint8_t* at) {
    return Samples(vreinterpretq_s16_u16(vshll_n_u8(vld1_u8(at), kGreyBits)));
  };
  return between(grey(pixels), grey(pixels + 1), right);
}
#else
Samples between(const Samples& upper, const Samples& lower, const Samples& down) {
  return upper + cv::v_mul_hi(cv::v_shl<1>(lower - upper), down);
}
Samples across(const std::uint8_t* pixels, const Samples& right) {
  const Samples here = cv::v_reinterpret_as_s16(cv::vx_load_expand(pixels));
  const Samples next = cv::v_reinterpret_as_s16(cv::vx_load_expand(pixels + 1));
  return cv::v_shl<kGreyBits>(here) + cv::v_mul_hi(cv::v_shl<kGreyBits + 1>(next - here), right);
}
#endif

constexpr int kDropped = kGreyBits - kCoarseBits;  // from 1/64 to 1/8

Samples scharr(const Samples& before, const Samples& at, const Samples& after) {
  return at + cv::v_mul_hi((before - at) + (after - at), cv::vx_setall_s16(kScharr));
}

/// What is kept of the patch in the first image.
template <std::size_t Columns>
struct Patch {
  using Block = std::array<std::array<std::int16_t, Columns>, kMaxSide>;
  Block value;       ///< 1/64 grey level, less what rounds a difference from it
  Block gradient_u;  ///< 1/16 grey level / px; 0 outside of patch and image
  Block gradient_v;
};

/// All bits set where a column of the patch is in the image. The mirrored pixels beyond do not move with it, so they
/// shall not pull.
template <std::size_t Columns>
std::array<std::int16_t, Columns> columns_inside(const ImageView& image, std::int32_t side, std::int32_t left) {
  std::array<std::int16_t, Columns> inside{};
  const std::int32_t end = std::min(side, image.width - left);
  for (std::int32_t c = std::max(0, -left); c < end; ++c) inside[static_cast<std::size_t>(c)] = -1;
  return inside;
}

template <std::size_t Columns>
void take_patch(const ImageView& image, std::int32_t side, const Place& place, Patch<Columns>& patch) {
  // With one more row and column all around, and room for the vectors that begin at the second and third column.
  std::array<std::array<std::int16_t, Columns + kLanes>, kMaxSide + 2> wide{};
  std::array<std::int16_t, Columns + kLanes> down{};
  const std::uint8_t* corner = place.pixels - place.stride - 1;
  for (std::size_t c = 0; c < Columns; c += kLanes) {
    Samples upper = across(corner + c, place.right);
    for (std::int32_t r = 0; r < side + 2; ++r) {
      const Samples lower = across(corner + (r + 1) * place.stride + c, place.right);
      cv::v_store(&wide[r][c], between(upper, lower, place.down));
      upper = lower;
    }
  }
  const std::array<std::int16_t, Columns> shown = columns_inside<Columns>(image, side, place.column);
  const std::array<std::int16_t, Columns> none{};
  const Samples half = cv::vx_setall_s16(1 << (kDropped - 1));
  for (std::int32_t r = 0; r < side; ++r) {
    const bool in_image = place.row + r >= 0 && place.row + r < image.height;
    const std::int16_t* inside = in_image ? shown.data() : none.data();
    const std::int16_t* above = wide[r].data();
    const std::int16_t* at = wide[r + 1].data();
    const std::int16_t* below = wide[r + 2].data();
    for (std::size_t c = 0; c < Columns; c += kLanes) {
      cv::v_store(&down[c], scharr(cv::vx_load(above + c), cv::vx_load(at + c), cv::vx_load(below + c)));
    }
    for (std::size_t c = 0; c < Columns; c += kLanes) {
      const Samples mask = cv::vx_load(inside + c);
      const Samples rise_u = cv::vx_load(&down[c + 2]) - cv::vx_load(&down[c]);
      const Samples rise_v = scharr(cv::vx_load(below + c), cv::vx_load(below + c + 1), cv::vx_load(below + c + 2)) -
                             scharr(cv::vx_load(above + c), cv::vx_load(above + c + 1), cv::vx_load(above + c + 2));
      cv::v_store(&patch.value[r][c], cv::vx_load(at + c + 1) - half);
      cv::v_store(&patch.gradient_u[r][c], cv::v_shr<kDropped>(rise_u + half) & mask);
      cv::v_store(&patch.gradient_v[r][c], cv::v_shr<kDropped>(rise_v + half) & mask);
    }
  }
}

/// Sums of products of the gradients.
struct Tensor {
  std::int64_t uu = 0;
  std::int64_t uv = 0;
  std::int64_t vv = 0;

  std::int64_t determinant() const { return uu * vv - uv * uv; }
  /// Whether the smaller eigenvalue reaches the limit, by the signs of the characteristic polynomial.
  bool reaches(std::int64_t limit) const {
    return uu >= limit && vv >= limit && (uu - limit) * (vv - limit) >= uv * uv && determinant() > 0;
  }
};

template <std::size_t Columns>
Tensor tensor_of(const Patch<Columns>& patch, std::int32_t side) {
  Sums uu = cv::vx_setzero_s32();
  Sums uv = cv::vx_setzero_s32();
  Sums vv = cv::vx_setzero_s32();
  for (std::int32_t r = 0; r < side; ++r) {
    for (std::size_t c = 0; c < Columns; c += kLanes) {
      const Samples u = cv::vx_load(&patch.gradient_u[r][c]);
      const Samples v = cv::vx_load(&patch.gradient_v[r][c]);
      uu = cv::v_dotprod_fast(u, u, uu);
      uv = cv::v_dotprod_fast(u, v, uv);
      vv = cv::v_dotprod_fast(v, v, vv);
    }
  }
  return {cv::v_reduce_sum(uu), cv::v_reduce_sum(uv), cv::v_reduce_sum(vv)};
}

/// Sums of the difference of the images times the gradients of the patch.
struct Slope {
  std::int64_t u = 0;
  std::int64_t v = 0;
};

template <std::size_t Columns>
Slope slope_at(const Place& place, std::int32_t side, const Patch<Columns>& patch) {
  Sums u = cv::vx_setzero_s32();
  Sums v = cv::vx_setzero_s32();
  for (std::size_t c = 0; c < Columns; c += kLanes) {
    Samples upper = across(place.pixels + c, place.right);
    for (std::int32_t r = 0; r < side; ++r) {
      const Samples lower = across(place.pixels + (r + 1) * place.stride + c, place.right);
      const Samples seen = between(upper, lower, place.down);
      const Samples difference = cv::v_shr<kDropped>(seen - cv::vx_load(&patch.value[r][c]));
      u = cv::v_dotprod_fast(difference, cv::vx_load(&patch.gradient_u[r][c]), u);
      v = cv::v_dotprod_fast(difference, cv::vx_load(&patch.gradient_v[r][c]), v);
      upper = lower;
    }
  }
  return {cv::v_reduce_sum(u), cv::v_reduce_sum(v)};
}

/// Sum of the absolute differences of the patches at two places [1/64 grey level].
template <std::size_t Columns>
std::int32_t difference_of(const Place& first, const Place& second, std::int32_t side) {
  const Samples one = cv::vx_setall_s16(1);
  Sums sum = cv::vx_setzero_s32();
  for (std::size_t c = 0; c < Columns; c += kLanes) {
    std::array<std::int16_t, kLanes> mask{};
    for (std::size_t i = 0; i < kLanes; ++i) mask[i] = static_cast<std::int32_t>(c + i) < side ? -1 : 0;
    const Samples inside = cv::vx_load(mask.data());
    Samples upper_a = across(first.pixels + c, first.right);
    Samples upper_b = across(second.pixels + c, second.right);
    for (std::int32_t r = 0; r < side; ++r) {
      const Samples lower_a = across(first.pixels + (r + 1) * first.stride + c, first.right);
      const Samples lower_b = across(second.pixels + (r + 1) * second.stride + c, second.right);
      const Samples a = between(upper_a, lower_a, first.down);
      const Samples b = between(upper_b, lower_b, second.down);
      sum = cv::v_dotprod_fast(cv::v_reinterpret_as_s16(cv::v_absdiff(a, b)) & inside, one, sum);
      upper_a = lower_a;
      upper_b = lower_b;
    }
  }
  return cv::v_reduce_sum(sum);
}

constexpr std::int32_t kNarrow = 16;
static_assert(kNarrow % kLanes == 0);
/// Whether a patch and its neighbours fit in rows of kNarrow columns.
bool is_narrow(std::int32_t side) { return side + 2 <= kNarrow; }

}  // namespace

PatchFlow::PatchFlow(const TrackerOptions& options)
    : window_px_(options.window_px),
      max_iterations_(options.max_iterations),
      epsilon2_px2_(options.epsilon_px * options.epsilon_px),
      min_eigenvalue_(static_cast<std::int64_t>(
          std::ceil(options.min_eigenvalue * kOpenCvTensor * kTensorScale * options.window_px * options.window_px))) {
  PLUMB_ASSERT(window_px_ >= 1 && window_px_ <= kMaxSide && window_px_ % 2 == 1);
}

template <std::size_t Columns>
void PatchFlow::refine_with(const ImageView& from, const ImageView& to, FlowPoint& point) const {
  const double half_px = (window_px_ - 1) / 2;
  const double from_u_px = static_cast<double>(point.from_u_px) - half_px;
  const double from_v_px = static_cast<double>(point.from_v_px) - half_px;
  point.found = false;
  if (!touches(from, window_px_, from_u_px, from_v_px)) return;
  Patch<Columns> patch;
  take_patch(from, window_px_, place_at(from, from_u_px, from_v_px), patch);
  const Tensor tensor = tensor_of(patch, window_px_);
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
    if (oscillates || step_u_px * step_u_px + step_v_px * step_v_px <= epsilon2_px2_) break;
  }
  point.to_u_px = static_cast<float>(u_px + half_px);
  point.to_v_px = static_cast<float>(v_px + half_px);
  point.found = touches(to, window_px_, u_px, v_px);
}

void PatchFlow::refine(const ImageView& from, const ImageView& to, FlowPoint& point) const {
  if (is_narrow(window_px_)) {
    refine_with<kNarrow>(from, to, point);
  } else {
    refine_with<kMaxColumns>(from, to, point);
  }
}

float PatchFlow::residual(const ImageView& from, const ImageView& to, const FlowPoint& point) const {
  const double half_px = (window_px_ - 1) / 2;
  const Place first =
      place_at(from, static_cast<double>(point.from_u_px) - half_px, static_cast<double>(point.from_v_px) - half_px);
  const Place second =
      place_at(to, static_cast<double>(point.to_u_px) - half_px, static_cast<double>(point.to_v_px) - half_px);
  const std::int32_t sum = is_narrow(window_px_) ? difference_of<kNarrow>(first, second, window_px_)
                                                 : difference_of<kMaxColumns>(first, second, window_px_);
  return static_cast<float>(sum) / static_cast<float>((window_px_ * window_px_) << kGreyBits);
}

}  // namespace plumb
