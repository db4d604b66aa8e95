#include "test/support/sim/rig.h"

#include <numbers>

namespace plumb::sim {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

/// Camera z down, y (image down) backward, x (image right) to the body's right.
Quat nadir_mounting() {
  Mat3 r_IC;
  r_IC << 0.0, -1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, -1.0;
  return Quat(r_IC);
}

}  // namespace

SensorCalibration Rig::calibration() const {
  SensorCalibration calibration;
  calibration.q_IC = q_IC;
  calibration.p_IC_m = p_IC_m;
  calibration.p_CR_m = p_CR_m;
  calibration.u_C = u_C;
  calibration.focal_px = CameraModel(camera).focal_px();
  calibration.half_fov_x = 0.5 * camera.width / camera.fx;
  calibration.half_fov_y = 0.5 * camera.height / camera.fy;
  return calibration;
}

Rig plain_rig() {
  Rig rig;
  rig.camera.width = 640;
  rig.camera.height = 480;
  rig.camera.fx = 400.0;
  rig.camera.fy = 400.0;
  rig.camera.cx = 319.5;
  rig.camera.cy = 239.5;
  rig.q_IC = nadir_mounting();
  return rig;
}

Rig nadir_rig(double tilt_deg) {
  Rig rig = plain_rig();
  // Turning about the camera's x axis by a positive angle brings its view from the nadir towards the nose.
  const Quat tilt(Eigen::AngleAxisd(tilt_deg * kDegree, Vec3::UnitX()));
  const Quat misalignment = so3_exp(kDegree * Vec3(1.5, -1.0, 2.0));
  rig.q_IC = (nadir_mounting() * tilt * misalignment).normalized();
  rig.p_IC_m = Vec3(0.08, -0.03, -0.05);
  rig.p_CR_m = Vec3(0.04, 0.01, -0.005);
  rig.u_C = Vec3(0.02, -0.015, 1.0).normalized();
  return rig;
}

}  // namespace plumb::sim
