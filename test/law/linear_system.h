#pragma once
// The linearised system of the paper's observability analysis (section IV), written from its equations and sharing
// nothing with the flight code but the SO(3) helpers: state x0 = [p, v, q, b_g, b_a, F_1 ... F_N] with Cartesian
// features in W and the local attitude error R = R_hat Exp(dtheta).

#include <array>
#include <functional>
#include <vector>

#include "test/support/sim/trajectory.h"

namespace plumb::law {

/// Offsets into the error state.
inline constexpr Eigen::Index kP = 0;
inline constexpr Eigen::Index kV = 3;
inline constexpr Eigen::Index kTheta = 6;
inline constexpr Eigen::Index kGyro = 9;
inline constexpr Eigen::Index kAccel = 12;
inline constexpr Eigen::Index kCore = 15;
constexpr Eigen::Index feature_at(std::size_t j) { return kCore + 3 * static_cast<Eigen::Index>(j); }

inline constexpr double kGravity_m_s2 = 9.80665;

using Motion = std::function<sim::TruthState(double t_s)>;
using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

/// A camera and a range finder at the same place on the IMU, and the features they see. The ranged facet is made of the
/// first three.
struct System {
  Motion motion;
  Quat q_IC = Quat::Identity();
  Vec3 p_IC_m = Vec3::Zero();
  Vec3 u_C = Vec3::UnitZ();
  std::vector<Vec3> features_m;

  Eigen::Index size() const { return feature_at(features_m.size()); }
};

/// Error transition of the core over [from_s, to_s] along the true motion, by a fourth-order rule with 1 ms steps:
/// p' = v,  v' = -R [f]x dtheta - R db_a,  dtheta' = -[w]x dtheta - db_g, with f the specific force.
Matrix transition(const Motion& motion, double from_s, double to_s);

/// Two rows per feature: its projection (paper eq. 4 to 6).
Matrix camera_rows(const System& system, double t_s);
/// One row: the ranged facet (paper eq. 8 to 11 and the M_{k,p_j} of section IV-A, with their common 1/b).
Matrix range_row(const System& system, double t_s);

enum class Sensors { kCamera, kCameraAndRange };

/// Rows H_k Phi_{k,1} for k = 1 ... `steps`, `period_s` apart, from start_s on.
Matrix observability_matrix(const System& system, Sensors sensors, double start_s, double period_s, int steps);

/// |M n| against the size it would have if the columns did not cancel: 0 in the null space, of order 1 far from it.
double residual(const Matrix& m, const Vector& n);
/// Dimension of the null space of M: pivots of its rank-revealing QR below 1e-9 of the largest, after scaling the
/// columns to unit length.
int nullity(const Matrix& m);

}  // namespace plumb::law
