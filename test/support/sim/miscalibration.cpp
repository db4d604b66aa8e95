#include "test/support/sim/miscalibration.h"

namespace plumb::sim {

CalibrationOptions uncalibrated_sensors() {
  CalibrationOptions sigmas;
  sigmas.time_offset_sigma_s = 4e-3;
  sigmas.camera_rotation_sigma_rad = 0.01;
  sigmas.camera_position_sigma_m = 0.03;
  sigmas.beam_tilt_sigma_rad = 0.01;
  sigmas.beam_origin_sigma_m = 0.03;
  sigmas.gyro_scale_sigma = 3e-3;
  sigmas.accel_scale_sigma = 3e-3;
  return sigmas;
}

CalibrationError draw_calibration_error(const CalibrationOptions& sigmas, std::uint64_t seed) {
  Random random(seed, kCalibrationStream);
  CalibrationError error;
  error.segment<3>(0) = sigmas.gyro_scale_sigma * random.normal3();
  error.segment<3>(3) = sigmas.accel_scale_sigma * random.normal3();
  error(6) = sigmas.time_offset_sigma_s * random.normal();
  error.segment<3>(7) = sigmas.camera_rotation_sigma_rad * random.normal3();
  error.segment<3>(10) = sigmas.camera_position_sigma_m * random.normal3();
  error(13) = sigmas.beam_tilt_sigma_rad * random.normal();
  error(14) = sigmas.beam_tilt_sigma_rad * random.normal();
  error.segment<3>(15) = sigmas.beam_origin_sigma_m * random.normal3();
  return error;
}

SensorCalibration calibration_file(const Rig& rig, const CalibrationError& error) {
  SensorCalibration file = rig.calibration();
  file.q_IC = so3_exp(-Vec3(error.segment<3>(7))) * rig.q_IC;
  file.p_IC_m -= error.segment<3>(10);
  file.p_CR_m -= error.segment<3>(15);
  // u = normalised(u_file + N tilt), solved for u_file: N belongs to it, so a few rounds.
  for (int round = 0; round < 20; ++round) {
    const Mat3 axes = rotation_between(Vec3::UnitZ(), file.u_C).toRotationMatrix();
    const Vec3 off = axes.leftCols<2>() * error.segment<2>(13);
    file.u_C = (rig.u_C * std::sqrt(1.0 + off.squaredNorm()) - off).normalized();
  }
  return file;
}

void apply(const CalibrationError& error, FlightSettings& settings) {
  settings.imu.gyro_scale = error.segment<3>(0);
  settings.imu.accel_scale = error.segment<3>(3);
  settings.image_time_offset_s = error(6);
}

}  // namespace plumb::sim
