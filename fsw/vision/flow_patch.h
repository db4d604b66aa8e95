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

 private:
  // With one more row and column all around, and room for the vectors that begin at the second and third column.
  using WideRow = std::array<std::int16_t, Columns + kGreyLanes>;
  using WideBlock = std::array<WideRow, kMaxSide + 2>;
  /// All bits set where a pixel of the patch is in the image. The mirrored pixels beyond do not move with it, so they
  /// shall not pull.
  struct Inside {
    Row columns{};
    std::int32_t first_row = 0;
    std::int32_t end_row = 0;
    std::int32_t count = 0;  ///< of pixels
  };
  /// Sums over the pixels inside.
  struct Sums {
    std::int32_t count = 0;
    GreySums grey = cv::vx_setzero_s32();  ///< 1/8 grey level, above the middle
    GreySums grey2 = cv::vx_setzero_s32();
    GreySums u = cv::vx_setzero_s32();  ///< 1/128 grey level / px
    GreySums v = cv::vx_setzero_s32();
    GreySums grey_u = cv::vx_setzero_s32();  ///< of coarse ones
    GreySums grey_v = cv::vx_setzero_s32();
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
  static Light light_in(const Sums& sums, const GreySums& gradient, const GreySums& product);
  static GreySamples above_middle(const GreySamples& value) {
    return cv::v_shr<kDroppedBits>(value) - cv::vx_setall_s16(128 << kCoarseBits);
  }
  Sums differentiate(std::int32_t side, const WideBlock& wide, const Inside& inside);
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
    GreySamples upper = across(corner + c, place.right);
    for (std::int32_t r = 0; r < side + 2; ++r) {
      const GreySamples lower = across(corner + (r + 1) * place.stride + c, place.right);
      cv::v_store(&wide[r][c], between(upper, lower, place.down));
      upper = lower;
    }
  }
}

/// Leaves the gradients in 1/128 grey level / px.
template <std::size_t Columns>
typename FlowPatch<Columns>::Sums FlowPatch<Columns>::differentiate(std::int32_t side, const WideBlock& wide,
                                                                    const Inside& inside) {
  const Row none{};
  WideRow down{};
  Sums sums;
  sums.count = inside.count;
  for (std::int32_t r = 0; r < side; ++r) {
    const std::int16_t* shown = r >= inside.first_row && r < inside.end_row ? inside.columns.data() : none.data();
    const std::int16_t* above = wide[r].data();
    const std::int16_t* at = wide[r + 1].data();
    const std::int16_t* below = wide[r + 2].data();
    for (std::size_t c = 0; c < Columns; c += kGreyLanes) {
      cv::v_store(&down[c], scharr(cv::vx_load(above + c), cv::vx_load(at + c), cv::vx_load(below + c)));
    }
    for (std::size_t c = 0; c < Columns; c += kGreyLanes) {
      const GreySamples mask = cv::vx_load(shown + c);
      const GreySamples u = (cv::vx_load(&down[c + 2]) - cv::vx_load(&down[c])) & mask;
      const GreySamples v = (scharr(cv::vx_load(below + c), cv::vx_load(below + c + 1), cv::vx_load(below + c + 2)) -
                             scharr(cv::vx_load(above + c), cv::vx_load(above + c + 1), cv::vx_load(above + c + 2))) &
                            mask;
      const GreySamples here = cv::vx_load(at + c + 1);
      const GreySamples grey = above_middle(here) & mask;
      cv::v_store(&value[r][c], here);
      cv::v_store(&gradient_u[r][c], u);
      cv::v_store(&gradient_v[r][c], v);
      sums.grey = sum_with(sums.grey, grey);
      sums.grey2 = cv::v_dotprod_fast(grey, grey, sums.grey2);
      sums.u = sum_with(sums.u, u);
      sums.v = sum_with(sums.v, v);
      sums.grey_u = cv::v_dotprod_fast(coarse(u), grey, sums.grey_u);
      sums.grey_v = cv::v_dotprod_fast(coarse(v), grey, sums.grey_v);
    }
  }
  return sums;
}

template <std::size_t Columns>
typename FlowPatch<Columns>::Light FlowPatch<Columns>::light_in(const Sums& sums, const GreySums& gradient,
                                                                const GreySums& product) {
  constexpr double kGainScale = 1 << kGainBits;
  constexpr double kMaxGain = 32767.0;
  const double count = std::max(1, sums.count);
  const double grey = cv::v_reduce_sum(sums.grey);
  const double rise = cv::v_reduce_sum(gradient);
  const double common = (1 << kDroppedBits) * static_cast<double>(cv::v_reduce_sum(product));
  // All of them are whole numbers below 2^53. Without contrast there is no gain to see.
  const double spread = count * static_cast<double>(cv::v_reduce_sum(sums.grey2)) - grey * grey;
  const double gain = spread > 0.0 ? (count * common - grey * rise) / spread : 0.0;
  const double rounded = std::clamp(std::floor(kGainScale * gain + 0.5), -kMaxGain, kMaxGain);
  const double constant = std::floor((rise - rounded / kGainScale * grey) / count + 0.5);
  return {cv::vx_setall_s16(static_cast<std::int16_t>(constant)),
          cv::vx_setall_s16(static_cast<std::int16_t>(rounded))};
}

template <std::size_t Columns>
void FlowPatch<Columns>::take_out(const Light& in_u, const Light& in_v, std::int32_t side, const Inside& inside) {
  const Row none{};
  for (std::int32_t r = 0; r < side; ++r) {
    const std::int16_t* shown = r >= inside.first_row && r < inside.end_row ? inside.columns.data() : none.data();
    for (std::size_t c = 0; c < Columns; c += kGreyLanes) {
      const GreySamples mask = cv::vx_load(shown + c);
      const GreySamples grey = above_middle(cv::vx_load(&value[r][c]));
      cv::v_store(&gradient_u[r][c], coarse(cv::vx_load(&gradient_u[r][c]) - in_u.of(grey)) & mask);
      cv::v_store(&gradient_v[r][c], coarse(cv::vx_load(&gradient_v[r][c]) - in_v.of(grey)) & mask);
    }
  }
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
