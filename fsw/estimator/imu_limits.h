#pragma once
// Whether an inertial sample can be a measurement at all.

#include <array>
#include <cmath>

#include "fsw/estimator/options.h"
#include "fsw/math/so3.h"
#include "fsw/measurement/samples.h"

namespace plumb {

/// Finite, and within what the options say that the sensor can tell.
inline bool is_within_limits(const ImuSample& sample, const ImuOptions& options) {
  const auto up_to = [](const std::array<double, 3>& v, double limit) {
    return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]) && Vec3(v.data()).norm() <= limit;
  };
  return up_to(sample.gyro_rad_s, options.max_gyro_rad_s) && up_to(sample.accel_m_s2, options.max_accel_m_s2);
}

}  // namespace plumb
