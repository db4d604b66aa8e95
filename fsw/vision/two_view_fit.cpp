#include "fsw/vision/two_view_fit.h"

#include <algorithm>

#include "fsw/vision/vector_types.h"

namespace plumb::two_view {
namespace {

// Two at a time on every machine: sums over more rows than one would not be in the same order with more.
using Doubles = cv::v_float64x2;
constexpr std::size_t kLanes = Doubles::nlanes;
using Floats = cv::v_float32;
using Components = Matches::Components;
static_assert(Matches::kWhole % Floats::nlanes == 0);
constexpr std::size_t kMatchesAskedOnce = 16;  // after so many, whether the cost is beyond the bound

// Of an information that nothing is known of, so that it can be solved for.
constexpr double kNoTurn = 1e-24;
constexpr double kNoMove = 1e-9;

/// Geman-McClure: what is far beyond the scale has no say.
Doubles robust_weights(const Doubles& squared_errors, double scale) {
  const Doubles one = cv::v_setall_f64(1.0);
  const Doubles cauchy = one / (one + squared_errors / cv::v_setall_f64(scale * scale));
  return cauchy * cauchy;
}

/// Adds lanes in fours, one four after the other.
cv::v_float32x4 plus_fours(const cv::v_float32x4& sums, const Floats& fours) {
#if CV_SIMD_WIDTH == 32
  std::array<float, Floats::nlanes> lanes;
  cv::v_store(lanes.data(), fours);
  return sums + cv::v_load(lanes.data()) + cv::v_load(&lanes[4]);
#else
  return sums + fours;
#endif
}

/// In an order of ours: that of a vector unit's own sum is not the same on every machine.
float total(const cv::v_float32x4& sums) {
  std::array<float, 4> four;
  cv::v_store(four.data(), sums);
  return (four[0] + four[1]) + (four[2] + four[3]);
}

/// Vectors of as many matches as there are lanes.
struct Vectors {
  Doubles x;
  Doubles y;
  Doubles z;

  static Vectors at(const Components& all, std::size_t i) {
    return {cv::v_load(&all[0][i]), cv::v_load(&all[1][i]), cv::v_load(&all[2][i])};
  }
  static Vectors all(const Triple& v) {
    return {cv::v_setall_f64(v[0]), cv::v_setall_f64(v[1]), cv::v_setall_f64(v[2])};
  }
  void keep(Components& all, std::size_t i) const {
    cv::v_store(&all[0][i], x);
    cv::v_store(&all[1][i], y);
    cv::v_store(&all[2][i], z);
  }
  Doubles dot(const Vectors& v) const { return x * v.x + (y * v.y + z * v.z); }
  Vectors cross(const Vectors& v) const { return {y * v.z - z * v.y, z * v.x - x * v.z, x * v.y - y * v.x}; }
  Vectors operator-(const Vectors& v) const { return {x - v.x, y - v.y, z - v.z}; }
};

/// A rotation in every lane.
struct Turn {
  Doubles w;
  Vectors axis;

  /// q v, as Eigen has it.
  Vectors operator()(const Vectors& v) const {
    const Vectors half = axis.cross(v);
    const Vectors twice{half.x + half.x, half.y + half.y, half.z + half.z};
    const Vectors bent = axis.cross(twice);
    return {v.x + w * twice.x + bent.x, v.y + w * twice.y + bent.y, v.z + w * twice.z + bent.z};
  }
};

/// Normal equations of N unknowns, summed over the even and over the odd matches.
template <std::size_t N>
class EquationSums {
 public:
  EquationSums() {
    for (auto& column : information_) column.fill(cv::v_setzero_f64());
    gradient_.fill(cv::v_setzero_f64());
  }
  /// One row of the least squares for each lane.
  void add(const std::array<Doubles, N>& row, const Doubles& error, const Doubles& weight) {
    const Doubles pull = weight * error;
#pragma GCC unroll 8
    for (std::size_t c = 0; c < N; ++c) {
      const Doubles weighted = weight * row[c];
#pragma GCC unroll 8
      for (std::size_t r = c; r < N; ++r) {
        information_[c][r] = information_[c][r] + weighted * row[r];
      }
      gradient_[c] = gradient_[c] + pull * row[c];
    }
  }
  /// `known`: what is added to the information of each unknown.
  NormalEquations<N> total(double known) const {
    NormalEquations<N> equations;
    for (std::size_t c = 0; c < N; ++c) {
      for (std::size_t r = c; r < N; ++r) equations.information[c][r] = cv::v_reduce_sum(information_[c][r]);
      equations.information[c][c] += known;
      equations.gradient[c] = cv::v_reduce_sum(gradient_[c]);
    }
    return equations;
  }

 private:
  std::array<std::array<Doubles, N>, N> information_;
  std::array<Doubles, N> gradient_;
};

}  // namespace

void derotate(Matches& matches, const std::array<Triple, 3>& R_C2C1) {
  const Vectors x = Vectors::all(R_C2C1[0]);
  const Vectors y = Vectors::all(R_C2C1[1]);
  const Vectors z = Vectors::all(R_C2C1[2]);
  for (std::size_t i = 0; i < matches.filled(); i += kLanes) {
    const Vectors previous = Vectors::at(matches.previous, i);
    const Vectors current = Vectors::at(matches.current, i);
    const Vectors derotated{x.dot(previous), y.dot(previous), z.dot(previous)};
    derotated.keep(matches.derotated, i);
    (current - derotated).keep(matches.flow, i);
    derotated.cross(current).keep(matches.normal, i);
  }
}

void round_for_costs(Matches& matches) {
  const auto round = [&matches](const Components& from, Matches::Singles& to) {
    for (std::size_t k = 0; k < 3; ++k) {
      for (std::size_t i = 0; i < matches.filled(); i += kLanes * 2) {
        cv::v_store(&to[k][i], cv::v_cvt_f32(cv::v_load(&from[k][i]), cv::v_load(&from[k][i + kLanes])));
      }
    }
  };
  round(matches.derotated, matches.derotated_single);
  round(matches.flow, matches.flow_single);
  round(matches.normal, matches.normal_single);
}

Cost cost_of(const Matches& matches, const Triple& direction, double threshold_rad, float bound) {
  const Floats zero = cv::vx_setzero_f32();
  const Floats one = cv::vx_setall_f32(1.0F);
  const Floats limit = cv::vx_setall_f32(static_cast<float>(threshold_rad * threshold_rad));
  const Floats floor = cv::vx_setall_f32(static_cast<float>(kEpipoleFloor));
  const Floats t_x = cv::vx_setall_f32(static_cast<float>(direction[0]));
  const Floats t_y = cv::vx_setall_f32(static_cast<float>(direction[1]));
  const Floats t_z = cv::vx_setall_f32(static_cast<float>(direction[2]));
  const auto along_t = [&](const Matches::Singles& all, std::size_t i) {
    return t_x * cv::vx_load(&all[0][i]) + t_y * cv::vx_load(&all[1][i]) + t_z * cv::vx_load(&all[2][i]);
  };
  cv::v_float32x4 towards = cv::v_setzero_f32();
  cv::v_float32x4 away = cv::v_setzero_f32();
  for (std::size_t i = 0; i < matches.count; i += Floats::nlanes) {
    const Floats cosine = along_t(matches.derotated_single, i);
    const Floats along = along_t(matches.flow_single, i);
    const Floats off = along_t(matches.normal_single, i);
    const Floats inverse = one / cv::v_max(one - cosine * cosine, floor);
    const Floats across = off * off * inverse;
    const Floats both = across + along * along * inverse;
    towards = plus_fours(towards, cv::v_min(cv::v_select(along < zero, both, across), limit));
    away = plus_fours(away, cv::v_min(cv::v_select(along > zero, both, across), limit));
    const bool asked = (i + Floats::nlanes) % kMatchesAskedOnce == 0;
    if (asked && total(towards) >= bound && total(away) >= bound) break;
  }
  return {.towards = total(towards), .away = total(away)};
}

// Each component of the error d x b - e has a row of its own: the sums are those of b's cross product with itself.
NormalEquations<3> turn_equations(const Matches& matches, const std::array<double, 4>& q_C2C1, double scale_rad) {
  const Turn turn{cv::v_setall_f64(q_C2C1[0]), Vectors::all({q_C2C1[1], q_C2C1[2], q_C2C1[3]})};
  const Doubles zero = cv::v_setzero_f64();
  EquationSums<3> sums;
  for (std::size_t i = 0; i < matches.count; i += kLanes) {
    const Vectors b = turn(Vectors::at(matches.previous, i));
    const Vectors error = Vectors::at(matches.current, i) - b;
    const Doubles weight = robust_weights(error.dot(error), scale_rad);
    sums.add({zero, b.z, zero - b.y}, error.x, weight);
    sums.add({zero - b.z, zero, b.x}, error.y, weight);
    sums.add({b.y, zero - b.x, zero}, error.z, weight);
  }
  return sums.total(kNoTurn);
}

NormalEquations<5> move_equations(const Matches& matches, const Tangent& tangent, double scale_rad) {
  const Doubles zero = cv::v_setzero_f64();
  const Doubles one = cv::v_setall_f64(1.0);
  const Vectors t = Vectors::all(tangent.direction);
  const Vectors e1 = Vectors::all(tangent.e1);
  const Vectors e2 = Vectors::all(tangent.e2);
  EquationSums<5> sums;
  for (std::size_t i = 0; i < matches.count; i += kLanes) {
    const Vectors current = Vectors::at(matches.current, i);
    const Vectors derotated = Vectors::at(matches.derotated, i);
    const Vectors flow = Vectors::at(matches.flow, i);
    const Vectors normal = Vectors::at(matches.normal, i);
    const Doubles cosine = t.dot(derotated);
    const Doubles inverse2 = one / cv::v_max(one - cosine * cosine, cv::v_setall_f64(kEpipoleFloor));
    const Doubles across = t.dot(normal);
    const Doubles backward = cv::v_min(t.dot(flow), zero);
    const Doubles weight = inverse2 * robust_weights((across * across + backward * backward) * inverse2, scale_rad);
    // t . ((b1 + d x b1) x b2) = t . n + d . (b1 x (b2 x t)) and t . (b2 - b1 - d x b1) = t . flow + d . (t x b1)
    const Vectors turned_off = derotated.cross(current.cross(t));
    sums.add({turned_off.x, turned_off.y, turned_off.z, e1.dot(normal), e2.dot(normal)}, zero - across, weight);
    if (!cv::v_check_any(backward < zero)) continue;  // as most, where there is parallax
    const Vectors turned_back = t.cross(derotated);
    sums.add({turned_back.x, turned_back.y, turned_back.z, e1.dot(flow), e2.dot(flow)}, zero - backward,
             cv::v_select(backward < zero, weight, zero));
  }
  return sums.total(kNoMove);
}

}  // namespace plumb::two_view
