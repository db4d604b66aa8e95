#include "fsw/math/so3.h"

#include <cmath>

#include "fsw/math/exact.h"

namespace plumb {
namespace {
// Below this angle the truncated series is exact to the last bit of a double.
constexpr double kSmallAngle = 1e-4;  // rad
}  // namespace

Quat so3_exp(const Vec3& rotation_vector) {
  const double angle = rotation_vector.norm();
  double half_sinc = 0.0;  // sin(angle/2) / angle
  if (angle < kSmallAngle) {
    half_sinc = 0.5 - angle * angle / 48.0;
  } else {
    half_sinc = exact::sin(0.5 * angle) / angle;
  }
  const Vec3 v = half_sinc * rotation_vector;
  return Quat(exact::cos(0.5 * angle), v.x(), v.y(), v.z()).normalized();
}

Vec3 so3_log(const Quat& q) {
  const double sign = q.w() < 0.0 ? -1.0 : 1.0;  // q and -q are one rotation: take the short way
  const double w = sign * q.w();
  const Vec3 v = sign * q.vec();
  const double s = v.norm();
  if (s < kSmallAngle) return (2.0 / w - 2.0 * s * s / (3.0 * w * w * w)) * v;
  return (2.0 * exact::atan2(s, w) / s) * v;
}

Mat3 so3_left_jacobian(const Vec3& rotation_vector) {
  const double angle = rotation_vector.norm();
  const Mat3 k = skew(rotation_vector);
  if (angle < kSmallAngle) return Mat3::Identity() + 0.5 * k + k * k / 6.0;
  const double angle2 = angle * angle;
  return Mat3::Identity() + ((1.0 - exact::cos(angle)) / angle2) * k +
         ((angle - exact::sin(angle)) / (angle2 * angle)) * k * k;
}

Quat halfway(const Quat& a, const Quat& b) {
  const double sign = a.dot(b) < 0.0 ? -1.0 : 1.0;  // b and -b are one rotation
  return Quat(a.coeffs() + sign * b.coeffs()).normalized();
}

Quat rotation_between(const Vec3& from, const Vec3& to) {
  const Vec3 a = from.normalized();
  const Vec3 b = to.normalized();
  const double c = a.dot(b);
  if (c > -1.0 + 1e-12) {
    const Vec3 v = a.cross(b);
    return Quat(1.0 + c, v.x(), v.y(), v.z()).normalized();
  }
  const Vec3 helper = std::abs(a.x()) < 0.9 ? Vec3::UnitX() : Vec3::UnitY();
  const Vec3 axis = a.cross(helper).normalized();
  return Quat(0.0, axis.x(), axis.y(), axis.z());
}

}  // namespace plumb
