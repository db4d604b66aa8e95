#pragma once
// Records in which every field differs from its default and from its neighbours.

#include "fsw/telemetry/messages.h"

namespace plumb::test {

inline NavStateRecord sample_nav_state() {
  NavStateRecord record;
  record.t_image = Time::from_ns(1'403'636'584'763'555'584);
  record.sequence = 0xfedcba98U;
  record.state_hash = 0xf123456789abcdefU;
  NavState& state = record.state;
  state.t = record.t_image;
  state.valid = true;
  state.t_vision = Time::from_ns(31);
  state.t_range = Time::from_ns(32);
  record.status = {.valid = true, .mode = NavMode::kVio, .reliable_for_s = 12.25};
  state.reset_count = 7;
  state.p_WI_m = {1.5, -2.25, 1e-300};
  state.v_WI_m_s = {0.1, 0.2, 0.3};
  state.q_WI = {0.5, -0.5, 0.5, -0.5};
  state.b_gyro_rad_s = {0.01, 0.02, 0.03};
  state.b_accel_m_s2 = {0.04, 0.05, 0.06};
  for (std::size_t i = 0; i < state.covariance.size(); ++i) state.covariance[i] = 1.0 / (1.0 + static_cast<double>(i));
  record.report.tracks = 1;
  record.report.slam_features = 2;
  record.report.slam_used = 3;
  record.report.slam_rejected = 4;
  record.report.slam_added = 5;
  record.report.slam_nis = 13.5;
  record.report.msckf_used = 6;
  record.report.msckf_rejected = 7;
  record.report.track_nis = 90.5;
  record.report.track_rows = 91;
  record.report.ranged_used = 12;
  record.report.ranged_rejected = 13;
  record.report.ranged_nis = 16.5;
  record.report.ranged_judged = 17;
  record.report.ranges_used = 8;
  record.report.range_outcome = RangeOutcome::kBadGeometry;
  record.report.range_facet = {21, 22, 0xffffffffU};
  record.report.range_feature = 14;
  record.report.range_measured_m = 9.5;
  record.report.range_predicted_m = 10.5;
  record.report.range_sigma_m = 11.5;
  record.report.zero_velocity = true;
  record.report.directions_used = 15;
  record.report.heading_known = state.heading_known = true;
  return record;
}

inline InputFrame sample_input() {
  InputFrame frame;
  frame.tick = 123456789012;
  frame.t = Time::from_ns(4'000'000);
  for (std::size_t i = 0; i < kMaxImuPerFrame; ++i) {
    const auto x = static_cast<double>(i);
    static_cast<void>(frame.imu.push_back({.t = Time::from_ns(static_cast<std::int64_t>(1000 * i)),
                                           .gyro_rad_s = {x, -x, 0.1 * x},
                                           .accel_m_s2 = {x + 1.0, x + 2.0, x + 3.0}}));
  }
  static_cast<void>(frame.range.push_back({.t = Time::from_ns(7), .range_m = 12.5, .quality = RangeQuality::kValid}));
  static_cast<void>(frame.range.push_back({.t = Time::from_ns(9), .range_m = 0.0, .quality = RangeQuality::kWeak}));
  static_cast<void>(frame.direction.push_back({.t = Time::from_ns(8),
                                               .source = DirectionSource::kMagnetometer,
                                               .seen_I = {0.1, 0.2, 0.3},
                                               .known_W = {0.4, 0.5, 0.6}}));
  static_cast<void>(frame.commands.push_back({.source = 0xfffffff1U,
                                              .sequence = 0xfffffff2U,
                                              .id = 0xfff3U,
                                              .arguments = {1.5, 2.5, 3.5, 4.5},
                                              .verdict = CommandVerdict::kArgument}));
  frame.has_camera = true;
  frame.handover = Handover::kReleased;
  frame.image_skipped = true;
  frame.nav_missed = true;
  frame.camera = {.t_exposure_mid = Time::from_ns(3'999'999), .sequence = 42};
  return frame;
}

inline HealthRecord sample_health() {
  HealthRecord record;
  record.t = Time::from_ns(77);
  record.estimator.imu_samples = 0x8000000000000001U;
  record.estimator.resets = 3;
  record.system.samples_ahead = 6;
  record.system.frames_refused = 4;
  record.predictor.gaps = 5;
  record.tracking = {.position_m = 0.5, .velocity_m_s = 0.25, .attitude_rad = 0.125};
  record.calibration.value[6] = 0.003;
  record.calibration.sigma[17] = 0.002;
  record.pixel_noise_px = 0.75;
  record.system.commanded_resets = 2;
  record.status = {.valid = true, .mode = NavMode::kFailed, .reliable_for_s = 1.75};
  record.sensors[2] = {.state = SensorState::kDegraded,
                       .rate_hz = 24.5,
                       .t_last = Time::from_ns(71),
                       .refused_in_a_row = 72,
                       .samples = 73,
                       .refused = 74};
  return record;
}

inline TimingRecord sample_timing() {
  TimingRecord record{.t_image = Time::from_ns(5), .sequence = 6, .step_ns = 1000};
  for (std::size_t i = 0; i < kStageCount; ++i) record.stage_ns[i] = static_cast<std::int64_t>(10 + i);
  return record;
}

inline CameraCalibration sample_camera() {
  return {.width = 752,
          .height = 480,
          .fx = 458.0,
          .fy = 457.0,
          .cx = 367.0,
          .cy = 248.0,
          .distortion = Distortion::kEquidistant,
          .coefficients = {0.1, -0.2, 0.3, -0.4}};
}

inline SensorCalibration sample_sensors() {
  SensorCalibration sensors;
  sensors.q_IC = so3_exp(Vec3(0.1, 0.2, 0.3));
  sensors.p_IC_m = Vec3(0.4, 0.5, 0.6);
  sensors.p_CR_m = Vec3(0.7, 0.8, 0.9);
  sensors.u_C = Vec3(0.6, 0.0, 0.8);
  sensors.focal_px = 457.5;
  sensors.half_fov_x = 1.25;
  sensors.half_fov_y = 0.75;
  return sensors;
}

}  // namespace plumb::test
