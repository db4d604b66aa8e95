#include "test/support/sim/imu_model.h"

#include <cmath>
#include <numbers>

namespace plumb::sim {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kHour_s = 3600.0;
constexpr double kMilliG_m_s2 = 9.80665e-3;
constexpr double kInstabilityTime_s = 100.0;  // a walk of density b / sqrt(T) has wandered by b after T

}  // namespace

ImuNoise stim300_class() {
  ImuNoise noise;
  noise.gyro_noise_density = 0.15 * kDegree / std::sqrt(kHour_s);
  noise.gyro_bias_walk = 0.5 * kDegree / kHour_s / std::sqrt(kInstabilityTime_s);
  noise.gyro_turn_on_rad_s = 10.0 * kDegree / kHour_s;
  noise.accel_noise_density = 0.06 / std::sqrt(kHour_s);
  noise.accel_bias_walk = 0.05 * kMilliG_m_s2 / std::sqrt(kInstabilityTime_s);
  noise.accel_turn_on_m_s2 = 0.75 * kMilliG_m_s2;
  return noise;
}

ImuNoise mems_class() {
  ImuNoise noise;
  noise.gyro_noise_density = 4.0e-4;
  noise.gyro_bias_walk = 2.0e-5;
  noise.gyro_turn_on_rad_s = 0.5 * kDegree;
  noise.accel_noise_density = 1.0e-2;
  noise.accel_bias_walk = 5.0e-4;
  noise.accel_turn_on_m_s2 = 0.1;
  return noise;
}

ImuNoise noise_free() { return {}; }

ImuModel::ImuModel(const ImuNoise& noise, double rate_hz, double gravity_m_s2, std::uint64_t seed)
    : noise_(noise), period_s_(1.0 / rate_hz), gravity_m_s2_(gravity_m_s2), random_(seed, kImuStream) {
  gyro_bias_rad_s_ = noise_.gyro_turn_on_rad_s * random_.normal3();
  accel_bias_m_s2_ = noise_.accel_turn_on_m_s2 * random_.normal3();
}

ImuSample ImuModel::sample(const TruthState& truth, Time t) {
  // A density d becomes d / sqrt(dt) per sample of white noise and d sqrt(dt) per step of a walk.
  const double root_period = std::sqrt(period_s_);
  gyro_bias_rad_s_ += noise_.gyro_bias_walk * root_period * random_.normal3();
  accel_bias_m_s2_ += noise_.accel_bias_walk * root_period * random_.normal3();
  const Vec3 gyro =
      truth.omega_I_rad_s + gyro_bias_rad_s_ + noise_.gyro_noise_density / root_period * random_.normal3();
  const Vec3 specific_force = truth.q_WI.conjugate() * (truth.a_WI_m_s2 + gravity_m_s2_ * Vec3::UnitZ());
  const Vec3 accel = specific_force + accel_bias_m_s2_ + noise_.accel_noise_density / root_period * random_.normal3();
  ImuSample sample;
  sample.t = t;
  for (int axis = 0; axis < 3; ++axis) {
    sample.gyro_rad_s[axis] = gyro[axis] / (1.0 + noise_.gyro_scale[axis]);
    sample.accel_m_s2[axis] = accel[axis] / (1.0 + noise_.accel_scale[axis]);
  }
  return sample;
}

}  // namespace plumb::sim
