#pragma once
// Rotations. Hamilton quaternions; q_WI and R_WI rotate vectors from I to W; Exp maps a rotation vector [rad] to SO(3).

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace plumb {

using Vec2 = Eigen::Vector2d;
using Vec3 = Eigen::Vector3d;
using Mat2 = Eigen::Matrix2d;
using Mat3 = Eigen::Matrix3d;
using Quat = Eigen::Quaterniond;

/// Cross-product matrix: skew(a) b = a x b.
inline Mat3 skew(const Vec3& a) {
  Mat3 m;
  m << 0.0, -a.z(), a.y(), a.z(), 0.0, -a.x(), -a.y(), a.x(), 0.0;
  return m;
}

/// Rotation vector to unit quaternion; by series near zero, so that it is smooth and finite everywhere.
Quat so3_exp(const Vec3& rotation_vector);

/// Unit quaternion to the rotation vector of length at most pi.
Vec3 so3_log(const Quat& q);

/// Left Jacobian of SO(3): Exp(a + d) = Exp(J_l(a) d) Exp(a) to first order in d.
Mat3 so3_left_jacobian(const Vec3& rotation_vector);

/// The rotation in the middle of the shortest way from a to b (not opposite), of unit quaternions.
Quat halfway(const Quat& a, const Quat& b);

/// The smallest rotation that takes `from` to `to` (neither zero; opposite vectors turn about any normal).
Quat rotation_between(const Vec3& from, const Vec3& to);

}  // namespace plumb
