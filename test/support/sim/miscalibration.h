#pragma once
// Sensors that are not where the calibration file says.

#include "fsw/estimator/report.h"
#include "test/support/sim/scene.h"

namespace plumb::sim {

/// True values minus those of the file, in the order and units of CalibrationReport.
using CalibrationError = Eigen::Matrix<double, CalibrationReport::kSize, 1>;

/// What the sensors of a rig that was put together with care, and not calibrated, are off by.
CalibrationOptions uncalibrated_sensors();

/// One draw of what a filter with these options expects.
CalibrationError draw_calibration_error(const CalibrationOptions& sigmas, std::uint64_t seed);

/// The calibration file of a rig whose truth is off it by `error`.
SensorCalibration calibration_file(const Rig& rig, const CalibrationError& error);

/// The same error in what the sensors say: stamps of images and IMU readings.
void apply(const CalibrationError& error, FlightSettings& settings);

}  // namespace plumb::sim
