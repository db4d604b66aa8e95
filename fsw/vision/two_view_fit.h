#pragma once
// Least squares over the matches of two images: a small rotation alone, or with the direction of the translation. What
// matches say is worked out for several at a time, one to a lane, and summed one after the other, so that the number of
// lanes does not show in the bits.

#include <array>
#include <cstddef>
#include <opencv2/core/hal/intrin.hpp>

#include "fsw/math/so3.h"

namespace plumb::two_view {

using Doubles = cv::v_float64x2;
constexpr std::size_t kLanes = Doubles::nlanes;

using Vec5 = Eigen::Matrix<double, 5, 1>;
using Mat5 = Eigen::Matrix<double, 5, 5>;

constexpr double kEpipoleFloor = 1e-6;  // squared sine to the epipole under which a match says nothing

/// Geman-McClure: what is far beyond the scale has no say.
inline Doubles robust_weights(const Doubles& squared_errors, double scale) {
  const Doubles one = cv::v_setall_f64(1.0);
  const Doubles cauchy = one / (one + squared_errors / cv::v_setall_f64(scale * scale));
  return cauchy * cauchy;
}

/// Vectors of as many matches as there are lanes.
struct Vectors {
  Doubles x;
  Doubles y;
  Doubles z;

  template <class Components>
  static Vectors at(const Components& all, std::size_t i) {
    return {cv::v_load(&all[0][i]), cv::v_load(&all[1][i]), cv::v_load(&all[2][i])};
  }
  static Vectors all(const Vec3& v) {
    return {cv::v_setall_f64(v.x()), cv::v_setall_f64(v.y()), cv::v_setall_f64(v.z())};
  }
  template <class Components>
  void keep(Components& all, std::size_t i) const {
    cv::v_store(&all[0][i], x);
    cv::v_store(&all[1][i], y);
    cv::v_store(&all[2][i], z);
  }
  Doubles dot(const Vectors& v) const { return x * v.x + (y * v.y + z * v.z); }
  Vectors cross(const Vectors& v) const { return {y * v.z - z * v.y, z * v.x - x * v.z, x * v.y - y * v.x}; }
  Vectors operator-(const Vectors& v) const { return {x - v.x, y - v.y, z - v.z}; }
};

/// q v, as Eigen has it.
inline Vectors turn(const Quat& q, const Vectors& v) {
  const Vectors axis = Vectors::all(q.vec());
  const Doubles w = cv::v_setall_f64(q.w());
  const Vectors half = axis.cross(v);
  const Vectors twice{half.x + half.x, half.y + half.y, half.z + half.z};
  const Vectors bent = axis.cross(twice);
  return {v.x + w * twice.x + bent.x, v.y + w * twice.y + bent.y, v.z + w * twice.z + bent.z};
}

/// Normal equations of a small rotation d alone: Exp(d) b = b + d x b. Only the lower triangle of the information is
/// there.
struct TurnEquations {
  Mat3 information = Mat3::Identity() * 1e-24;
  Vec3 gradient = Vec3::Zero();

  /// The matches in the first `count` lanes, one after the other.
  void add(const Vectors& b, const Vectors& error, double scale_rad, std::size_t count) {
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
    std::array<std::array<double, kLanes>, all.size()> of;
    for (std::size_t k = 0; k < all.size(); ++k) cv::v_store(of[k].data(), all[k]);
    for (std::size_t lane = 0; lane < count; ++lane) {
      information(0, 0) += of[0][lane];
      information(1, 0) -= of[1][lane];
      information(2, 0) -= of[2][lane];
      information(1, 1) += of[3][lane];
      information(2, 1) -= of[4][lane];
      information(2, 2) += of[5][lane];
      gradient += Vec3(of[6][lane], of[7][lane], of[8][lane]);
    }
  }
};

/// Normal equations of a small rotation and of a direction that moves in its tangent plane. Only the lower triangle of
/// the information is there.
struct NormalEquations {
  Mat5 information = Mat5::Identity() * 1e-9;
  Vec5 gradient = Vec5::Zero();

  void add(const Vec5& jacobian, double weight, double error) {
    const Vec5 weighted = weight * jacobian;
    for (Eigen::Index c = 0; c < 5; ++c) {
      for (Eigen::Index r = c; r < 5; ++r) information(r, c) += weighted[r] * jacobian[c];
    }
    gradient -= weight * error * jacobian;
  }
};

/// One row of the least squares for each lane.
struct Rows {
  std::array<std::array<double, kLanes>, 5> jacobian;
  std::array<double, kLanes> error;

  Rows(const Vectors& by_rotation, const Doubles& by_e1, const Doubles& by_e2, const Doubles& factor,
       const Doubles& errors) {
    const std::array<Doubles, 5> all = {by_rotation.x, by_rotation.y, by_rotation.z, by_e1, by_e2};
    for (std::size_t k = 0; k < all.size(); ++k) cv::v_store(jacobian[k].data(), all[k] * factor);
    cv::v_store(error.data(), errors);
  }
  void add_to(NormalEquations& equations, std::size_t lane, double weight) const {
    Vec5 row;
    for (std::size_t k = 0; k < jacobian.size(); ++k) row[static_cast<Eigen::Index>(k)] = jacobian[k][lane];
    equations.add(row, weight, error[lane]);
  }
};

/// A match in each lane.
struct Matches {
  Vectors current;    ///< b2
  Vectors derotated;  ///< b1' in C2
  Vectors flow;       ///< b2 - b1'
  Vectors normal;     ///< b1' x b2
};

/// A direction and its tangent plane, in every lane.
struct Tangent {
  Vectors direction;
  Vectors e1;
  Vectors e2;
};

/// Adds what the matches in the first `count` lanes say, one after the other.
inline void add_rows(const Matches& seen, const Tangent& t, double scale_rad, std::size_t count,
                     NormalEquations& equations) {
  const Doubles zero = cv::v_setzero_f64();
  const Doubles one = cv::v_setall_f64(1.0);
  const Doubles cosine = t.direction.dot(seen.derotated);
  const Doubles inverse = one / cv::v_sqrt(cv::v_max(one - cosine * cosine, cv::v_setall_f64(kEpipoleFloor)));
  const Doubles across = t.direction.dot(seen.normal) * inverse;
  const Doubles backward = cv::v_min(t.direction.dot(seen.flow), zero) * inverse;
  std::array<double, kLanes> weight;
  cv::v_store(weight.data(), robust_weights(across * across + backward * backward, scale_rad));
  // t . ((b1 + d x b1) x b2) = t . n + d . (b1 x (b2 x t)) and t . (b2 - b1 - d x b1) = t . flow + d . (t x b1)
  const Rows off(seen.derotated.cross(seen.current.cross(t.direction)), t.e1.dot(seen.normal), t.e2.dot(seen.normal),
                 inverse, across);
  const Rows back(t.direction.cross(seen.derotated), t.e1.dot(seen.flow), t.e2.dot(seen.flow), inverse, backward);
  for (std::size_t lane = 0; lane < count; ++lane) {
    off.add_to(equations, lane, weight[lane]);
    if (back.error[lane] < 0.0) back.add_to(equations, lane, weight[lane]);
  }
}

}  // namespace plumb::two_view
