#pragma once
// IMU propagation: the nominal state by strapdown integration, the error by the accumulated transition and noise of all
// samples up to the horizon, applied to the covariance once.

#include "fsw/estimator/error_state.h"
#include "fsw/estimator/imu_buffer.h"
#include "fsw/estimator/options.h"
#include "fsw/math/strapdown.h"

namespace plumb {

/// Nominal core state.
struct CoreState {
  KinematicState motion;
  Vec3 b_gyro_rad_s = Vec3::Zero();
  Vec3 b_accel_m_s2 = Vec3::Zero();
  Vec3 gyro_scale = Vec3::Zero();  ///< a reading is to be multiplied by 1 + scale, axis by axis, before the bias goes
  Vec3 accel_scale = Vec3::Zero();

  /// What an IMU reading says of the motion.
  InertialRates rates(const InertialRates& read) const {
    return without_bias(with_scale(read, gyro_scale, accel_scale), b_gyro_rad_s, b_accel_m_s2);
  }
};

/// From I at `to` to I at `from`, by the gyro as the core corrects it. Precondition: the buffer spans both.
Quat gyro_rotation(const ImuBuffer& imu, const CoreState& core, Time from, Time to);

using Mat156 = Eigen::Matrix<double, 15, 6, Eigen::RowMajor>;

/// Moves a pose by the right-invariant correction (theta, xi), exactly on the group.
void retract_pose(const Vec3& theta, const Vec3& xi_p, Quat& q, Vec3& p);

/// Moves the core by an error of 15 elements, laid out as in error_state.h.
void retract_core(CoreState& core, const double* error);

/// Transition and noise of the core error over an interval, built up step by step.
struct CoreTransition {
  Mat15 phi = Mat15::Identity();
  Mat15 q = Mat15::Zero();
  bool with_scale = false;           ///< whether by_scale is wanted
  Mat156 by_scale = Mat156::Zero();  ///< what errors of the scale factors (gyro, accelerometer) add to the core error
};

/// Advances the nominal state over one IMU interval (raw, bias-carrying rates) and appends the interval to
/// `transition`. First order in the error, exact in time for a constant linearisation over the step. A hole in the
/// samples and a reading at the end of its scale cost what the rates may have been meanwhile.
void propagate_step(CoreState& state, CoreTransition& transition, const ImuInterval& interval,
                    const ImuOptions& options);

/// Error dynamics d(error)/dt = F error, frozen at one state (theta, xi_p, xi_v, b_g, b_a).
Mat15 error_dynamics(const KinematicState& motion, double gravity_m_s2);

}  // namespace plumb
