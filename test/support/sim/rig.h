#pragma once
// The sensor platform: where camera and laser sit on the IMU, and which lens the camera has.

#include "fsw/estimator/options.h"
#include "fsw/vision/camera_model.h"
#include "test/support/sim/trajectory.h"

namespace plumb::sim {

struct Rig {
  CameraCalibration camera;
  Quat q_IC = Quat::Identity();
  Vec3 p_IC_m = Vec3::Zero();
  Vec3 p_CR_m = Vec3::Zero();
  Vec3 u_C = Vec3::UnitZ();

  SensorCalibration calibration() const;

  Quat q_WC(const TruthState& truth) const { return truth.q_WI * q_IC; }
  Vec3 p_WC_m(const TruthState& truth) const { return truth.p_WI_m + truth.q_WI * p_IC_m; }
  /// Where the range finder's beam starts and its unit direction, in W.
  Vec3 beam_origin_m(const TruthState& truth) const { return p_WC_m(truth) + q_WC(truth) * p_CR_m; }
  Vec3 beam_direction(const TruthState& truth) const { return q_WC(truth) * u_C; }

  /// Where I must be, level, for the camera to stand this high above the origin.
  Vec3 ground_position_m(double camera_height_m) const { return {0.0, 0.0, camera_height_m - p_IC_m.z()}; }
};

/// 640 x 480 px, 400 px focal length, looking straight down, image up = forward, tilted forward by `tilt_deg`; mounted
/// with a few degrees of misalignment, a lever arm of a decimetre, and a laser 4 cm beside it that points 1.4 deg off.
Rig nadir_rig(double tilt_deg = 0.0);
/// The same without misalignment, lever arms or laser offset: for tests that need plain geometry.
Rig plain_rig();

}  // namespace plumb::sim
