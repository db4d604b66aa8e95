#include "fsw/estimator/stillness.h"

#include <cmath>

namespace plumb {
namespace {
constexpr std::size_t kMinSamples = 10;
constexpr double kMaxTurnRate = 0.2;       // rad/s, mean: larger than any turn-on bias, smaller than a real turn
constexpr double kMaxGravityError = 0.05;  // of gravity: a steady acceleration is not standing still
}  // namespace

bool imu_is_still(const ImuBuffer& imu, Time from, Time to, const StartOptions& options, double gravity_m_s2) {
  if (!imu.spans(from, to)) return false;
  const ImuStatistics s = imu.statistics(from, to);
  return s.count >= kMinSamples && s.gyro_deviation_rad_s < options.still_gyro_rad_s &&
         s.accel_deviation_m_s2 < options.still_accel_m_s2 && s.mean_gyro_rad_s.norm() < kMaxTurnRate &&
         std::abs(s.mean_accel_m_s2.norm() - gravity_m_s2) < kMaxGravityError * gravity_m_s2;
}

}  // namespace plumb
