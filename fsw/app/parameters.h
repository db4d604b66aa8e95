#pragma once
// Every run-time option of the flight software in one struct, and the table that names them. A new option is a member
// in its own options header and one row in parameters.cpp.

#include "fsw/base/fixed_vector.h"
#include "fsw/base/mission_config.h"
#include "fsw/estimator/options.h"
#include "fsw/modes/options.h"
#include "fsw/modes/reliability.h"
#include "fsw/params/param_table.h"
#include "fsw/telemetry/messages.h"
#include "fsw/vision/tracker_options.h"

namespace plumb {

struct Parameters {
  EstimatorOptions estimator;
  TrackerOptions tracker;
  ModeOptions modes;
};

/// Name, unit, range, default and meaning of each option.
const ParamTable<Parameters>& parameter_table();
/// ParamTable::crc() of it.
std::uint32_t parameter_table_crc();

inline constexpr std::size_t kMaxConflicts = 8;
/// What is wrong with values that each are in range but do not fit each other, a sentence each. What depends on the
/// image besides stands in TrackerOptions::check.
FixedVector<const char*, kMaxConflicts> conflicts_in(const Parameters& parameters);

/// Whether a compile-time configuration has states for all of the calibration that the parameters want estimated.
template <class Config>
bool has_calibration_room(const CalibrationOptions& wanted) {
  constexpr CalibrationBlocks kRoom = Config::kCalibration;
  const bool imu_scale = wanted.gyro_scale_sigma > 0.0 || wanted.accel_scale_sigma > 0.0;
  const bool camera = wanted.time_offset_sigma_s > 0.0 || wanted.camera_rotation_sigma_rad > 0.0 ||
                      wanted.camera_position_sigma_m > 0.0;
  const bool range_finder = wanted.beam_tilt_sigma_rad > 0.0 || wanted.beam_origin_sigma_m > 0.0;
  return (kRoom.imu_scale || !imu_scale) && (kRoom.camera || !camera) && (kRoom.range_finder || !range_finder);
}
inline constexpr const char* kCalibrationNeedsRoom =
    "calibration.* asks for states that this configuration has no room for; expected 0, or a replay with plumb-replay "
    "--config calibrating";

inline DriftModel drift_model(const ImuOptions& imu) {
  return {.gravity_m_s2 = imu.gravity_m_s2,
          .accel_noise_density = imu.accel_noise_density,
          .gyro_noise_density = imu.gyro_noise_density};
}

/// Every parameter in force, for the log.
ParamsRecord params_record(const Parameters& parameters, std::string_view configuration);

}  // namespace plumb
