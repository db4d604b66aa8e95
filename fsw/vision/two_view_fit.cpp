#include "fsw/vision/two_view_fit.h"

#include <algorithm>

#include "fsw/vision/vector_types.h"

namespace plumb::two_view {
namespace {

using Doubles = cv::v_float64;
constexpr std::size_t kLanes = Doubles::nlanes;
using Lanes = std::array<double, kLanes>;
using Components = Matches::Components;
static_assert(Matches::kWhole % kLanes == 0);

// Of an information that nothing is known of, so that it can be solved for.
constexpr double kNoTurn = 1e-24;
constexpr double kNoMove = 1e-9;

/// Geman-McClure: what is far beyond the scale has no say.
Doubles robust_weights(const Doubles& squared_errors, double scale) {
  const Doubles one = cv::vx_setall_f64(1.0);
  const Doubles cauchy = one / (one + squared_errors / cv::vx_setall_f64(scale * scale));
  return cauchy * cauchy;
}

/// Adds neighbouring lanes as pairs, one pair after the other.
cv::v_float64x2 plus_pairs(const cv::v_float64x2& sums, const Doubles& pairs) {
#if CV_SIMD_WIDTH == 32
  Lanes lanes;
  cv::v_store(lanes.data(), pairs);
  return sums + cv::v_load(lanes.data()) + cv::v_load(&lanes[2]);
#else
  return sums + pairs;
#endif
}

/// Vectors of as many matches as there are lanes.
struct Vectors {
  Doubles x;
  Doubles y;
  Doubles z;

  static Vectors at(const Components& all, std::size_t i) {
    return {cv::vx_load(&all[0][i]), cv::vx_load(&all[1][i]), cv::vx_load(&all[2][i])};
  }
  static Vectors all(const Triple& v) {
    return {cv::vx_setall_f64(v[0]), cv::vx_setall_f64(v[1]), cv::vx_setall_f64(v[2])};
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

/// One row of the least squares for each lane.
struct Rows {
  std::array<Lanes, 5> jacobian;
  Lanes error;

  Rows(const Vectors& by_rotation, const Doubles& by_e1, const Doubles& by_e2, const Doubles& factor,
       const Doubles& errors) {
    const std::array<Doubles, 5> all = {by_rotation.x, by_rotation.y, by_rotation.z, by_e1, by_e2};
    for (std::size_t k = 0; k < all.size(); ++k) cv::v_store(jacobian[k].data(), all[k] * factor);
    cv::v_store(error.data(), errors);
  }
  void add_to(NormalEquations<5>& equations, std::size_t lane, double weight) const {
    std::array<double, 5> row;
    std::array<double, 5> weighted;
    for (std::size_t k = 0; k < 5; ++k) {
      row[k] = jacobian[k][lane];
      weighted[k] = weight * row[k];
    }
    for (std::size_t c = 0; c < 5; ++c) {
      for (std::size_t r = c; r < 5; ++r) equations.information[c][r] += weighted[r] * row[c];
    }
    const double pull = weight * error[lane];
    for (std::size_t k = 0; k < 5; ++k) equations.gradient[k] -= pull * row[k];
  }
};

}  // namespace

void derotate(Matches& matches, const std::array<Triple, 3>& R_C2C1) {
  const Vectors x = Vectors::all(R_C2C1[0]);
  const Vectors y = Vectors::all(R_C2C1[1]);
  const Vectors z = Vectors::all(R_C2C1[2]);
  for (std::size_t i = 0; i < matches.count; i += kLanes) {
    const Vectors previous = Vectors::at(matches.previous, i);
    const Vectors current = Vectors::at(matches.current, i);
    const Vectors derotated{x.dot(previous), y.dot(previous), z.dot(previous)};
    derotated.keep(matches.derotated, i);
    (current - derotated).keep(matches.flow, i);
    derotated.cross(current).keep(matches.normal, i);
  }
}

Cost cost_of(const Matches& matches, const Triple& direction, double threshold_rad, double bound) {
  const Doubles zero = cv::vx_setzero_f64();
  const Doubles one = cv::vx_setall_f64(1.0);
  const Doubles limit = cv::vx_setall_f64(threshold_rad * threshold_rad);
  const Doubles floor = cv::vx_setall_f64(kEpipoleFloor);
  const Vectors t = Vectors::all(direction);
  const auto along_t = [&t](const Components& all, std::size_t i) {
    return t.x * cv::vx_load(&all[0][i]) + t.y * cv::vx_load(&all[1][i]) + t.z * cv::vx_load(&all[2][i]);
  };
  cv::v_float64x2 sums = cv::v_setzero_f64();  // towards, away
  for (std::size_t i = 0; i < matches.count; i += kLanes) {
    const Doubles cosine = along_t(matches.derotated, i);
    const Doubles along = along_t(matches.flow, i);
    const Doubles off = along_t(matches.normal, i);
    const Doubles inverse = one / cv::v_max(one - cosine * cosine, floor);
    const Doubles across = off * off * inverse;
    const Doubles both = across + along * along * inverse;
    const Doubles towards = cv::v_min(cv::v_select(along < zero, both, across), limit);
    const Doubles away = cv::v_min(cv::v_select(along > zero, both, across), limit);
    Doubles first;
    Doubles second;
    cv::v_zip(towards, away, first, second);
    sums = plus_pairs(plus_pairs(sums, first), second);
    if (cv::v_check_all(sums >= cv::v_setall_f64(bound))) break;
  }
  std::array<double, 2> both_ways;
  cv::v_store(both_ways.data(), sums);
  return {.towards = both_ways[0], .away = both_ways[1]};
}

NormalEquations<3> turn_equations(const Matches& matches, const std::array<double, 4>& q_C2C1, double scale_rad) {
  const Turn turn{cv::vx_setall_f64(q_C2C1[0]), Vectors::all({q_C2C1[1], q_C2C1[2], q_C2C1[3]})};
  NormalEquations<3> equations;
  auto& [information, gradient] = equations;
  for (std::size_t k = 0; k < 3; ++k) information[k][k] = kNoTurn;
  for (std::size_t i = 0; i < matches.count; i += kLanes) {
    const Vectors b = turn(Vectors::at(matches.previous, i));
    const Vectors error = Vectors::at(matches.current, i) - b;
    const Doubles weight = robust_weights(error.dot(error), scale_rad);
    const Vectors weighted{weight * b.x, weight * b.y, weight * b.z};
    const Vectors turning = weighted.cross(error);
    const std::array<Doubles, 9> all = {weighted.y * b.y + weighted.z * b.z,
                                        weighted.x * b.y,
                                        weighted.x * b.z,
                                        weighted.x * b.x + weighted.z * b.z,
                                        weighted.y * b.z,
                                        weighted.x * b.x + weighted.y * b.y,
                                        turning.x,
                                        turning.y,
                                        turning.z};
    std::array<Lanes, all.size()> of;
    for (std::size_t k = 0; k < all.size(); ++k) cv::v_store(of[k].data(), all[k]);
    for (std::size_t lane = 0; lane < std::min(kLanes, matches.count - i); ++lane) {
      information[0][0] += of[0][lane];
      information[0][1] -= of[1][lane];
      information[0][2] -= of[2][lane];
      information[1][1] += of[3][lane];
      information[1][2] -= of[4][lane];
      information[2][2] += of[5][lane];
      for (std::size_t k = 0; k < 3; ++k) gradient[k] += of[6 + k][lane];
    }
  }
  return equations;
}

NormalEquations<5> move_equations(const Matches& matches, const Tangent& tangent, double scale_rad) {
  const Doubles zero = cv::vx_setzero_f64();
  const Doubles one = cv::vx_setall_f64(1.0);
  const Vectors t = Vectors::all(tangent.direction);
  const Vectors e1 = Vectors::all(tangent.e1);
  const Vectors e2 = Vectors::all(tangent.e2);
  NormalEquations<5> equations;
  for (std::size_t k = 0; k < 5; ++k) equations.information[k][k] = kNoMove;
  for (std::size_t i = 0; i < matches.count; i += kLanes) {
    const Vectors current = Vectors::at(matches.current, i);
    const Vectors derotated = Vectors::at(matches.derotated, i);
    const Vectors flow = Vectors::at(matches.flow, i);
    const Vectors normal = Vectors::at(matches.normal, i);
    const Doubles cosine = t.dot(derotated);
    const Doubles inverse = one / cv::v_sqrt(cv::v_max(one - cosine * cosine, cv::vx_setall_f64(kEpipoleFloor)));
    const Doubles across = t.dot(normal) * inverse;
    const Doubles backward = cv::v_min(t.dot(flow), zero) * inverse;
    Lanes weight;
    cv::v_store(weight.data(), robust_weights(across * across + backward * backward, scale_rad));
    // t . ((b1 + d x b1) x b2) = t . n + d . (b1 x (b2 x t)) and t . (b2 - b1 - d x b1) = t . flow + d . (t x b1)
    const Rows off(derotated.cross(current.cross(t)), e1.dot(normal), e2.dot(normal), inverse, across);
    const Rows back(t.cross(derotated), e1.dot(flow), e2.dot(flow), inverse, backward);
    for (std::size_t lane = 0; lane < std::min(kLanes, matches.count - i); ++lane) {
      off.add_to(equations, lane, weight[lane]);
      if (back.error[lane] < 0.0) back.add_to(equations, lane, weight[lane]);
    }
  }
  return equations;
}

}  // namespace plumb::two_view
