#pragma once
// Whether an inertial sample can be a measurement at all.

#include <algorithm>
#include <array>
#include <cmath>

#include "fsw/estimator/options.h"
#include "fsw/measurement/samples.h"

namespace plumb {

/// Finite, and every axis within what the options say that the sensor can tell.
inline bool is_within_limits(const ImuSample& sample, const ImuOptions& options) {
  const auto up_to = [](const std::array<double, 3>& v, double limit) {
    return std::all_of(v.begin(), v.end(), [limit](double axis) { return std::abs(axis) <= limit; });
  };
  return up_to(sample.gyro_rad_s, options.max_gyro_rad_s) && up_to(sample.accel_m_s2, options.max_accel_m_s2);
}

}  // namespace plumb
