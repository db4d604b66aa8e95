#pragma once
// Strapdown integration of one IMU interval. Bias-free gyro and specific force at both ends are taken as linear between
// them: the rotation with its coning term, the specific force rotated at start, middle and end (Simpson's rule).
//
// Where the rates are linear, the error over a given time falls with the fourth power of the step. Of any other motion
// two samples tell no more than the straight line between them, and that costs an error that falls with the square of
// the sample period, however exactly the line is followed. Both are tested.

#include "fsw/math/so3.h"

namespace plumb {

/// Pose and velocity of I in W.
struct KinematicState {
  Quat q_WI = Quat::Identity();
  Vec3 p_WI_m = Vec3::Zero();
  Vec3 v_WI_m_s = Vec3::Zero();
};

/// Bias-free IMU values at one instant, in I.
struct InertialRates {
  Vec3 gyro_rad_s = Vec3::Zero();
  Vec3 accel_m_s2 = Vec3::Zero();
};

/// IMU values as measured, less their biases.
inline InertialRates without_bias(const InertialRates& measured, const Vec3& b_gyro_rad_s, const Vec3& b_accel_m_s2) {
  return {measured.gyro_rad_s - b_gyro_rad_s, measured.accel_m_s2 - b_accel_m_s2};
}

/// IMU values as measured, multiplied by 1 + scale axis by axis.
inline InertialRates with_scale(const InertialRates& measured, const Vec3& gyro_scale, const Vec3& accel_scale) {
  return {measured.gyro_rad_s + gyro_scale.cwiseProduct(measured.gyro_rad_s),
          measured.accel_m_s2 + accel_scale.cwiseProduct(measured.accel_m_s2)};
}

/// Advances `state` by dt_s [s] from `start` to `end`; a negative dt_s integrates backwards. gravity_m_s2 > 0 points
/// along -z of W.
void strapdown_step(KinematicState& state, const InertialRates& start, const InertialRates& end, double dt_s,
                    double gravity_m_s2);

}  // namespace plumb
