#include "fsw/estimator/calibration.h"

#include <algorithm>
#include <cmath>

namespace plumb {

CalibrationState::CalibrationState(const SensorCalibration& file) : file_(file), sensors_(file) {
  normals_C_ = rotation_between(Vec3::UnitZ(), file.u_C).toRotationMatrix().leftCols<2>();
}

void CalibrationState::retract_camera(const double* error) {
  time_offset_s_ += error[0];
  sensors_.q_IC = (so3_exp(Vec3(error + 1)) * sensors_.q_IC).normalized();
  sensors_.p_IC_m += Vec3(error + 4);
}

void CalibrationState::retract_beam(const double* error) {
  tilt_ += Vec2(error);
  sensors_.u_C = (file_.u_C + normals_C_ * tilt_).normalized();
  sensors_.p_CR_m += Vec3(error + 2);
}

Mat67 CalibrationState::camera_by_mount(const KinematicState& motion, const Vec3& rate_I_rad_s) const {
  const Mat3 r_WI = motion.q_WI.toRotationMatrix();
  const Vec3 rate_W = r_WI * rate_I_rad_s;
  const Vec3 p_WC = motion.p_WI_m + r_WI * sensors_.p_IC_m;
  Mat67 by_mount;
  by_mount.col(0) << rate_W, motion.v_WI_m_s + motion.p_WI_m.cross(rate_W);
  by_mount.block<3, 3>(0, 1) = r_WI;
  by_mount.block<3, 3>(3, 1) = skew(p_WC) * r_WI;
  by_mount.block<3, 3>(0, 4).setZero();
  by_mount.block<3, 3>(3, 4) = r_WI;
  return by_mount;
}

Mat32 CalibrationState::beam_by_tilt() const {
  const Vec3& u = sensors_.u_C;
  const double length = (file_.u_C + normals_C_ * tilt_).norm();
  return (normals_C_ - u * (u.transpose() * normals_C_)) / length;
}

void CalibrationState::correct(const RangeRay& ray, KnownDepth& known) const {
  const double depth_m = 1.0 / known.rho_1_m + ray.axis_C.dot(sensors_.impact_C_m(ray.range_m) - ray.spot_C_m);
  if (!(depth_m > 0.0)) return;
  known.rho_1_m = 1.0 / depth_m;
  const double by_depth = -known.rho_1_m * known.rho_1_m;
  known.by_beam.head<2>() = by_depth * ray.range_m * ray.axis_C.transpose() * beam_by_tilt();
  known.by_beam.tail<3>() = by_depth * ray.axis_C.transpose();
}

bool CalibrationState::finite() const {
  return std::abs(time_offset_s_) <= kMaxTimeOffset_s && sensors_.q_IC.coeffs().allFinite() &&
         sensors_.p_IC_m.allFinite() && sensors_.u_C.allFinite() && sensors_.p_CR_m.allFinite();
}

std::array<double, kCameraMountSize + kBeamSize> CalibrationState::difference_from_file() const {
  std::array<double, kCameraMountSize + kBeamSize> out{};
  out[0] = time_offset_s_;
  Eigen::Map<Vec3>(out.data() + 1) = so3_log(sensors_.q_IC * file_.q_IC.conjugate());
  Eigen::Map<Vec3>(out.data() + 4) = sensors_.p_IC_m - file_.p_IC_m;
  Eigen::Map<Vec2>(out.data() + kCameraMountSize) = tilt_;
  Eigen::Map<Vec3>(out.data() + kCameraMountSize + 2) = sensors_.p_CR_m - file_.p_CR_m;
  return out;
}

}  // namespace plumb
