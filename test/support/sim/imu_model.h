#pragma once
// What an IMU on the trajectory would say: exact rate and specific force plus turn-on bias, bias random walk and white
// noise.

#include "fsw/measurement/samples.h"
#include "test/support/sim/random.h"
#include "test/support/sim/trajectory.h"

namespace plumb::sim {

struct ImuNoise {
  double gyro_noise_density = 0.0;   ///< rad/s/sqrt(Hz)
  double gyro_bias_walk = 0.0;       ///< rad/s^2/sqrt(Hz)
  double gyro_turn_on_rad_s = 0.0;   ///< 1 sigma per axis
  double accel_noise_density = 0.0;  ///< m/s^2/sqrt(Hz)
  double accel_bias_walk = 0.0;      ///< m/s^3/sqrt(Hz)
  double accel_turn_on_m_s2 = 0.0;   ///< 1 sigma per axis
  Vec3 gyro_scale = Vec3::Zero();    ///< every reading times 1 + scale, axis by axis, is right but for bias and noise
  Vec3 accel_scale = Vec3::Zero();
};

/// STIM300 class, from the datasheet's orders of magnitude: angular random walk 0.15 deg/sqrt(h), velocity random walk
/// 0.06 m/s/sqrt(h), gyro bias instability 0.5 deg/h and repeatability 10 deg/h, accelerometer 0.05 mg and 0.75 mg. The
/// walks reach the instability within about 100 s.
ImuNoise stim300_class();
/// A consumer part: ten times the noise, bias of half a degree per second and 0.1 m/s^2 at turn-on.
ImuNoise mems_class();
ImuNoise noise_free();

class ImuModel {
 public:
  ImuModel(const ImuNoise& noise, double rate_hz, double gravity_m_s2, std::uint64_t seed);

  /// The next sample. Call once per period of the rate, in order: the bias walks by one step each time.
  ImuSample sample(const TruthState& truth, Time t);

  /// Of the newest sample.
  const Vec3& gyro_bias_rad_s() const { return gyro_bias_rad_s_; }
  const Vec3& accel_bias_m_s2() const { return accel_bias_m_s2_; }

 private:
  ImuNoise noise_;
  double period_s_;
  double gravity_m_s2_;
  Random random_;
  Vec3 gyro_bias_rad_s_;
  Vec3 accel_bias_m_s2_;
};

}  // namespace plumb::sim
