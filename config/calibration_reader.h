#pragma once
// Calibration and noise figures, from the sensor.yaml files of an ASL folder or from sections with the same keys.

#include <filesystem>
#include <string>
#include <vector>

#include "config/section.h"
#include "fsw/app/nav_job.h"
#include "fsw/app/parameters.h"

namespace plumb {

// The keys are those of the ASL layout; each reader throws InputError, or hands it to `steps`.

/// Camera model and camera pose in the IMU, whose section has a T_BS as well. Null: one that cannot be read, which is a
/// fault already; the other is read for its own.
void read_camera(const YamlFile* camera, const YamlFile* imu, Calibration& calibration,
                 const Steps& steps = kUntilFirstFault);
/// What Kalibr's camchain-imucam.yaml has under the name of a camera: the same by its keys. Returns what is to be added
/// to the stamp of an image to be on the IMU's clock, its timeshift_cam_imu.
Duration read_kalibr_camera(const YamlFile& camera, Calibration& calibration, const Steps& steps = kUntilFirstFault);
/// Noise densities into the parameters. The keys of imu.yaml of Kalibr are these, too.
void read_imu_noise(const YamlFile& imu, Parameters& parameters, const Steps& steps = kUntilFirstFault);
/// Into the parameters if they are there: turn-on biases ("gyroscope_bias_stddev" rad/s, "accelerometer_bias_stddev"
/// m/s^2, 1 sigma per axis) and local gravity ("gravity_mps2").
void read_imu_options(const YamlFile& imu, Parameters& parameters, const Steps& steps = kUntilFirstFault);
/// Both.
void read_imu(const YamlFile& imu, Parameters& parameters, const Steps& steps = kUntilFirstFault);
/// The file's imu0, or without one the file itself, is the IMU that the cameras are placed by.
void read_kalibr_imu(const YamlFile& file, Parameters& parameters, const Steps& steps = kUntilFirstFault);
/// Beam into the calibration, noise and largest range into the parameters.
void read_range_finder(const YamlFile& range, Calibration& calibration, Parameters& parameters,
                       const Steps& steps = kUntilFirstFault);
/// Said of parameters of the tracker that fit each other and not the image.
inline constexpr const char* kTrackerNeedsRoom =
    "tracker.border leaves too little of the image; expected a pixel for each of tracker.tile_columns and "
    "tracker.tile_rows inside it, and tracker.window on both sides";
/// Parameter names and values, nested or with dots. All or nothing.
void read_parameters(const YamlFile& yaml, Parameters& parameters, const Steps& steps = kUntilFirstFault);

// The same from the folders of an ASL recording. A warning for each key they do not know: a misspelt optional key has
// no effect.
void read_camera(const std::filesystem::path& cam0, const std::filesystem::path& imu0, Calibration& calibration,
                 std::vector<std::string>& warnings);
void read_imu(const std::filesystem::path& imu0, Parameters& parameters, std::vector<std::string>& warnings);
void read_range_finder(const std::filesystem::path& range0, Calibration& calibration, Parameters& parameters,
                       std::vector<std::string>& warnings);
/// Noise of a sun sensor or a magnetometer into the parameters, which switches it on.
void read_direction_sensor(const std::filesystem::path& folder, DirectionSource source, Parameters& parameters,
                           std::vector<std::string>& warnings);
void read_parameters(const std::filesystem::path& file, Parameters& parameters);

}  // namespace plumb
