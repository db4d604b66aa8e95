#pragma once
// IMU propagation: the nominal state by strapdown integration, the error by the accumulated transition and noise of all
// samples up to the horizon, applied to the covariance once.

#include "fsw/estimator/error_state.h"
#include "fsw/estimator/options.h"
#include "fsw/math/strapdown.h"

namespace plumb {

/// Nominal core state.
struct CoreState {
  KinematicState motion;
  Vec3 b_gyro_rad_s = Vec3::Zero();
  Vec3 b_accel_m_s2 = Vec3::Zero();
};

/// Moves a pose by the right-invariant correction (theta, xi), exactly on the group.
void retract_pose(const Vec3& theta, const Vec3& xi_p, Quat& q, Vec3& p);

/// Moves the core by an error of 15 elements, laid out as in error_state.h.
void retract_core(CoreState& core, const double* error);

/// Transition and noise of the core error over an interval, built up step by step.
struct CoreTransition {
  Mat15 phi = Mat15::Identity();
  Mat15 q = Mat15::Zero();
};

/// Advances the nominal state over one IMU interval of dt_s seconds (raw, bias-carrying rates at both ends) and appends
/// the interval to `transition`. First order in the error, exact in time for a constant linearisation over the step.
void propagate_step(CoreState& state, CoreTransition& transition, const InertialRates& start, const InertialRates& end,
                    double dt_s, const ImuOptions& options);

/// Error dynamics d(error)/dt = F error, frozen at one state (theta, xi_p, xi_v, b_g, b_a).
Mat15 error_dynamics(const KinematicState& motion, double gravity_m_s2);

}  // namespace plumb
