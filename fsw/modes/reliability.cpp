#include "fsw/modes/reliability.h"

#include <algorithm>
#include <cmath>

namespace plumb {
namespace {

double entry(const NavState& state, std::size_t row, std::size_t column) {
  return state.covariance[row * kNavErrorSize + column];
}

double variance(const NavState& state, std::size_t at) { return entry(state, at, at); }

double largest_sigma(const NavState& state, std::size_t at) {
  return std::sqrt(std::max({variance(state, at), variance(state, at + 1), variance(state, at + 2)}));
}

double whole_variance(const NavState& state, std::size_t at) {
  return variance(state, at) + variance(state, at + 1) + variance(state, at + 2);
}

// The attitude error is local: its part about the vertical is that along the world's z axis, seen from the body.
double heading_variance(const NavState& state) {
  const auto& [w, x, y, z] = state.q_WI;
  const double up_I[3] = {2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)};
  double sum = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t k = 0; k < 3; ++k) sum += up_I[i] * entry(state, kNavAttitude + i, kNavAttitude + k) * up_I[k];
  }
  return sum;
}

}  // namespace

StateSigmas sigmas_of(const NavState& state) {
  const double tilt = whole_variance(state, kNavAttitude) - heading_variance(state);
  return {.position_m = largest_sigma(state, kNavPosition),
          .velocity_m_s = largest_sigma(state, kNavVelocity),
          .tilt_rad = std::sqrt(std::max(tilt, 0.0)),
          .gyro_bias_rad_s = std::sqrt(whole_variance(state, kNavGyroBias)),
          .accel_bias_m_s2 = std::sqrt(whole_variance(state, kNavAccelBias))};
}

StateSigmas unaided_after(double tau_s, const StateSigmas& now, const DriftModel& model) {
  const double tau2 = tau_s * tau_s;
  const double tau3 = tau2 * tau_s;
  const double acceleration = model.gravity_m_s2 * now.tilt_rad + now.accel_bias_m_s2;
  const double jerk = model.gravity_m_s2 * now.gyro_bias_rad_s;
  const double tilt_noise = model.gravity_m_s2 * model.gyro_noise_density;
  StateSigmas later = now;
  later.velocity_m_s += acceleration * tau_s + jerk * tau2 / 2.0 + model.accel_noise_density * std::sqrt(tau_s) +
                        tilt_noise * std::sqrt(tau3 / 3.0);
  later.position_m += now.velocity_m_s * tau_s + acceleration * tau2 / 2.0 + jerk * tau3 / 6.0 +
                      model.accel_noise_density * std::sqrt(tau3 / 3.0) + tilt_noise * std::sqrt(tau3 * tau2 / 20.0);
  later.tilt_rad += now.gyro_bias_rad_s * tau_s + model.gyro_noise_density * std::sqrt(tau_s);
  return later;
}

double time_to_unreliable_s(const NavState& state, const DriftModel& model, const ModeOptions& options) {
  if (!state.valid) return 0.0;
  const StateSigmas now = sigmas_of(state);
  // So put that what is not a number is not reliable.
  const auto reliable = [&](double tau_s) {
    const StateSigmas later = unaided_after(tau_s, now, model);
    return later.position_m <= options.position_sigma_limit_m && later.velocity_m_s <= options.velocity_sigma_limit_m_s;
  };
  if (!reliable(0.0)) return 0.0;
  if (reliable(options.horizon_s)) return options.horizon_s;
  double low = 0.0;  // the bounds grow with time, so that halving finds where they pass the limit
  double high = options.horizon_s;
  constexpr int kHalvings = 20;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    (reliable(middle) ? low : high) = middle;
  }
  return low;
}

}  // namespace plumb
