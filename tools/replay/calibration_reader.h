#pragma once
// Calibration and noise figures from the sensor.yaml files of an ASL folder.

#include <filesystem>
#include <string>
#include <vector>

#include "fsw/app/nav_system.h"
#include "fsw/app/parameters.h"

namespace plumb::replay {

// The readers of sensor.yaml files add a warning for each key they do not know: a misspelt optional key has no effect.

/// Camera model and camera pose in the IMU. Throws InputError.
void read_camera(const std::filesystem::path& cam0, const std::filesystem::path& imu0, Calibration& calibration,
                 std::vector<std::string>& warnings);
/// Noise densities into the parameters, and if they are there the turn-on biases ("gyroscope_bias_stddev" rad/s,
/// "accelerometer_bias_stddev" m/s^2, 1 sigma per axis) and local gravity ("gravity_mps2"). Throws InputError.
void read_imu(const std::filesystem::path& imu0, Parameters& parameters, std::vector<std::string>& warnings);
/// Beam into the calibration, noise and largest range into the parameters. Throws InputError.
void read_range_finder(const std::filesystem::path& range0, Calibration& calibration, Parameters& parameters,
                       std::vector<std::string>& warnings);
/// Noise of a sun sensor or a magnetometer into the parameters, which switches it on. Throws InputError.
void read_direction_sensor(const std::filesystem::path& folder, DirectionSource source, Parameters& parameters,
                           std::vector<std::string>& warnings);
/// A YAML file of parameter names and values, nested or with dots. Throws InputError with name, value and range.
void read_parameters(const std::filesystem::path& file, Parameters& parameters);

}  // namespace plumb::replay
