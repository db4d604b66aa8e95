#pragma once
// How long a state can be relied on if nothing aided it from now on: until position or velocity are worse than asked.
//
// Unaided, an error of attitude tilts gravity into the acceleration, a bias of the gyro turns the attitude and one of
// the accelerometer adds to the acceleration, so that after tau seconds
//
//   sigma_v <= s_v + (g s_tilt + s_ba) tau + g s_bg tau^2 / 2 + n_a tau^(1/2) + g n_g (tau^3 / 3)^(1/2)
//   sigma_p <= s_p + s_v tau + (g s_tilt + s_ba) tau^2 / 2 + g s_bg tau^3 / 6 + n_a (tau^3 / 3)^(1/2)
//              + g n_g (tau^5 / 20)^(1/2)
//
// with s of the covariance and n of the IMU's white noise: the deviation of a sum is at most the sum of the deviations,
// whatever the correlations. So the time is short rather than long. Taken for small: other accelerations than gravity,
// and the random walk of the biases.

#include "fsw/measurement/nav_state.h"
#include "fsw/modes/options.h"

namespace plumb {

/// What drives the errors of an unaided state.
struct DriftModel {
  double gravity_m_s2 = 9.80665;
  double accel_noise_density = 0.0;  ///< m/s^2/sqrt(Hz)
  double gyro_noise_density = 0.0;   ///< rad/s/sqrt(Hz)
};

/// Deviations of one state, 1 sigma: of the worst axis of position and velocity, over all axes of the others, and of
/// the attitude without the heading.
struct StateSigmas {
  double position_m = 0.0;
  double velocity_m_s = 0.0;
  double tilt_rad = 0.0;
  double gyro_bias_rad_s = 0.0;
  double accel_bias_m_s2 = 0.0;
};

StateSigmas sigmas_of(const NavState& state);

/// Bounds of position [m] and velocity [m/s] of `tau_s` later.
StateSigmas unaided_after(double tau_s, const StateSigmas& now, const DriftModel& model);

/// Seconds from the state's own time, 0 to options.horizon_s. 0: it is over a limit already, or not valid.
double time_to_unreliable_s(const NavState& state, const DriftModel& model, const ModeOptions& options);

}  // namespace plumb
