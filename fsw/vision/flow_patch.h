#pragma once
// What PatchFlow keeps of the patch in the first image: grey levels and gradients.
//
// Motion and light are solved for together: the patch in the second image differs by gradient * motion + a + b * grey
// level. What the gradients have in common with a constant and with the grey levels is taken out of them, once; what is
// left is blind to a and b, as the rows of a feature are to its position after the projection onto their null space.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "fsw/vision/grey_samples.h"

namespace plumb {

/// Sums of products of the gradients [(1/16 grey level / px)^2].
struct GradientTensor {
  std::int64_t uu = 0;
  std::int64_t uv = 0;
  std::int64_t vv = 0;

  std::int64_t determinant() const { return uu * vv - uv * uv; }
  /// Whether the smaller eigenvalue reaches the limit, by the signs of the characteristic polynomial.
  bool reaches(std::int64_t limit) const {
    return uu >= limit && vv >= limit && (uu - limit) * (vv - limit) >= uv * uv && determinant() > 0;
  }
};

/// Columns: of a row with a neighbour on each side, in whole vectors.
template <std::size_t Columns>
class FlowPatch {
 public:
  static constexpr std::int32_t kMaxSide = TrackerOptions::kMaxWindow_px;
  using Row = std::array<std::int16_t, Columns>;
  using Block = std::array<Row, kMaxSide>;

  /// Takes the patch with this upper left corner. Without light_change the gradients stay as they are.
  void take(const ImageView& image, std::int32_t side, const GreyPlace& place, bool light_change);

  Block value;       ///< 1/64 grey level
  Block gradient_u;  ///< 1/16 grey level / px; 0 outside of patch and image
  Block gradient_v;
  GradientTensor tensor;

 private:
  // With one more row and column all around, and room for the vectors that begin at the second and third column.
  using WideRow = std::array<std::int16_t, Columns + kGreyLanes>;
  using WideBlock = std::array<WideRow, kMaxSide + 2>;
  /// All bits set where a pixel of the patch is in the image. The mirrored pixels beyond do not move with it, so they
  /// shall not pull.
  struct Inside {
    Row columns{};
    Row none{};
    std::int32_t first_row = 0;
    std::int32_t end_row = 0;
    std::int32_t count = 0;  ///< of pixels

    GreySamples mask(std::int32_t row, std::size_t column) const {
      return cv::vx_load((row >= first_row && row < end_row ? columns : none).data() + column);
    }
  };
  /// Three neighbours of a row, seen from the one in the middle.
  struct Across {
    GreySamples here;
    GreySamples rise;    ///< from the first to the last
    GreySamples smooth;  ///< all three
    explicit Across(const std::int16_t* first)
        : here(cv::vx_load(first + 1)),
          rise(cv::vx_load(first + 2) - cv::vx_load(first)),
          smooth(scharr(cv::vx_load(first), here, cv::vx_load(first + 2))) {}
  };
  /// Over the pixels inside. All are whole numbers.
  struct Sums {
    double count = 0.0;
    double grey = 0.0;  ///< 1/8 grey level, above the middle
    double grey2 = 0.0;
    double u = 0.0;  ///< 1/128 grey level / px
    double v = 0.0;
    double grey_u = 0.0;  ///< of coarse gradients
    double grey_v = 0.0;
  };
  /// What a gradient has in common with light: constant + gain * grey level, by least squares over the patch.
  struct Light {
    GreySamples constant = cv::vx_setzero_s16();  ///< 1/128 grey level / px
    GreySamples gain = cv::vx_setzero_s16();      ///< 1/2^kGainBits of that a 1/8 grey level
    GreySamples of(const GreySamples& grey) const {
      return constant + weighted(cv::v_shl<kWeightBits - kGainBits>(grey), gain);
    }
  };
  static constexpr int kGainBits = 12;

  static Inside inside_of(const ImageView& image, std::int32_t side, const GreyPlace& place);
  static void sample(std::int32_t side, const GreyPlace& place, WideBlock& wide);
  static GreySamples above_middle(const GreySamples& value) {
    return cv::v_shr<kDroppedBits>(value) - cv::vx_setall_s16(128 << kCoarseBits);
  }
  /// Leaves the gradients in 1/128 grey level / px.
  Sums differentiate(std::int32_t side, const WideBlock& wide, const Inside& inside);
  static Light light_in(const Sums& sums, double gradient, double grey_gradient);
  /// Makes the gradients coarse, and their tensor.
  void take_out(const Light& in_u, const Light& in_v, std::int32_t side, const Inside& inside);
};

template <std::size_t Columns>
typename FlowPatch<Columns>::Inside FlowPatch<Columns>::inside_of(const ImageView& image, std::int32_t side,
                                                                  const GreyPlace& place) {
  Inside inside;
  const std::int32_t end = std::min(side, image.width - place.column);
  for (std::int32_t c = std::max(0, -place.column); c < end; ++c) inside.columns[static_cast<std::size_t>(c)] = -1;
  inside.first_row = std::max(0, -place.row);
  inside.end_row = std::min(side, image.height - place.row);
  inside.count = std::max(0, end - std::max(0, -place.column)) * std::max(0, inside.end_row - inside.first_row);
  return inside;
}

template <std::size_t Columns>
void FlowPatch<Columns>::sample(std::int32_t side, const GreyPlace& place, WideBlock& wide) {
  const std::uint8_t* corner = place.pixels - place.stride - 1;
  for (std::size_t c = 0; c < Columns; c += kGreyLanes) {
    for_each_row(place, corner + c, side + 2,
                 [&wide, c](std::int32_t r, const GreySamples& seen) { cv::v_store(&wide[r][c], seen); });
  }
}

template <std::size_t Columns>
typename FlowPatch<Columns>::Sums FlowPatch<Columns>::differentiate(std::int32_t side, const WideBlock& wide,
                                                                    const Inside& inside) {
  GreySums grey_sum = cv::vx_setzero_s32();
  GreySums grey2_sum = cv::vx_setzero_s32();
  GreySums u_sum = cv::vx_setzero_s32();
  GreySums v_sum = cv::vx_setzero_s32();
  GreySums grey_u_sum = cv::vx_setzero_s32();
  GreySums grey_v_sum = cv::vx_setzero_s32();
  for (std::size_t c = 0; c < Columns; c += kGreyLanes) {
    Across above(&wide[0][c]);
    Across at(&wide[1][c]);
    for (std::int32_t r = 0; r < side; ++r) {
      const Across below(&wide[r + 2][c]);
      const GreySamples mask = inside.mask(r, c);
      const GreySamples u = scharr(above.rise, at.rise, below.rise) & mask;
      const GreySamples v = (below.smooth - above.smooth) & mask;
      const GreySamples grey = above_middle(at.here) & mask;
      cv::v_store(&value[r][c], at.here);
      cv::v_store(&gradient_u[r][c], u);
      cv::v_store(&gradient_v[r][c], v);
      grey_sum = sum_with(grey_sum, grey);
      grey2_sum = cv::v_dotprod_fast(grey, grey, grey2_sum);
      u_sum = sum_with(u_sum, u);
      v_sum = sum_with(v_sum, v);
      grey_u_sum = cv::v_dotprod_fast(coarse(u), grey, grey_u_sum);
      grey_v_sum = cv::v_dotprod_fast(coarse(v), grey, grey_v_sum);
      above = at;
      at = below;
    }
  }
  const auto whole = [](const GreySums& sum) { return static_cast<double>(cv::v_reduce_sum(sum)); };
  return {static_cast<double>(inside.count),
          whole(grey_sum),
          whole(grey2_sum),
          whole(u_sum),
          whole(v_sum),
          whole(grey_u_sum),
          whole(grey_v_sum)};
}

template <std::size_t Columns>
typename FlowPatch<Columns>::Light FlowPatch<Columns>::light_in(const Sums& sums, double gradient,
                                                                double grey_gradient) {
  constexpr double kGainScale = 1 << kGainBits;
  constexpr double kMaxGain = 32767.0;
  constexpr double kFine = 1 << kDroppedBits;
  // Without contrast there is no gain to see.
  const double spread = sums.count * sums.grey2 - sums.grey * sums.grey;
  const double common = sums.count * kFine * grey_gradient - sums.grey * gradient;
  const double gain =
      spread > 0.0 ? std::clamp(std::floor(kGainScale * common / spread + 0.5), -kMaxGain, kMaxGain) : 0.0;
  const double rest = gradient - gain / kGainScale * sums.grey;
  const double constant = std::floor(rest / std::max(1.0, sums.count) + 0.5);
  return {cv::vx_setall_s16(static_cast<std::int16_t>(constant)), cv::vx_setall_s16(static_cast<std::int16_t>(gain))};
}

template <std::size_t Columns>
void FlowPatch<Columns>::take_out(const Light& in_u, const Light& in_v, std::int32_t side, const Inside& inside) {
  GreySums uu = cv::vx_setzero_s32();
  GreySums uv = cv::vx_setzero_s32();
  GreySums vv = cv::vx_setzero_s32();
  for (std::int32_t r = 0; r < side; ++r) {
    for (std::size_t c = 0; c < Columns; c += kGreyLanes) {
      const GreySamples mask = inside.mask(r, c);
      const GreySamples grey = above_middle(cv::vx_load(&value[r][c]));
      const GreySamples u = coarse(cv::vx_load(&gradient_u[r][c]) - in_u.of(grey)) & mask;
      const GreySamples v = coarse(cv::vx_load(&gradient_v[r][c]) - in_v.of(grey)) & mask;
      cv::v_store(&gradient_u[r][c], u);
      cv::v_store(&gradient_v[r][c], v);
      uu = cv::v_dotprod_fast(u, u, uu);
      uv = cv::v_dotprod_fast(u, v, uv);
      vv = cv::v_dotprod_fast(v, v, vv);
    }
  }
  tensor = {cv::v_reduce_sum(uu), cv::v_reduce_sum(uv), cv::v_reduce_sum(vv)};
}

template <std::size_t Columns>
void FlowPatch<Columns>::take(const ImageView& image, std::int32_t side, const GreyPlace& place, bool light_change) {
  WideBlock wide{};
  sample(side, place, wide);
  const Inside inside = inside_of(image, side, place);
  const Sums sums = differentiate(side, wide, inside);
  if (light_change) {
    take_out(light_in(sums, sums.u, sums.grey_u), light_in(sums, sums.v, sums.grey_v), side, inside);
  } else {
    take_out({}, {}, side, inside);
  }
}

}  // namespace plumb
