#include <algorithm>

#include "fsw/telemetry/lcm_codec.h"
#include "plumb_lcm/plumb/calibration_t.hpp"
#include "plumb_lcm/plumb/input_frame_t.hpp"
#include "plumb_lcm/plumb/nav_health_t.hpp"
#include "plumb_lcm/plumb/nav_output_t.hpp"
#include "plumb_lcm/plumb/nav_state_t.hpp"
#include "plumb_lcm/plumb/params_t.hpp"
#include "plumb_lcm/plumb/timing_t.hpp"
#include "plumb_lcm/plumb/truth_t.hpp"

namespace plumb {
namespace {

// Counters and hashes are unsigned; LCM has signed integers only. The bits stay.
std::int64_t as_signed(std::uint64_t value) { return static_cast<std::int64_t>(value); }
std::int32_t as_signed(std::uint32_t value) { return static_cast<std::int32_t>(value); }

template <std::size_t N>
void copy(const std::array<double, N>& from, double (&to)[N]) {
  std::copy(from.begin(), from.end(), to);
}

void copy(const Vec3& from, double (&to)[3]) { std::copy_n(from.data(), 3, to); }

template <std::size_t N>
void copy(const std::array<char, N>& from, std::uint8_t (&to)[N]) {
  std::copy(from.begin(), from.end(), to);
}

void fill_report(const FrameReport& report, nav_state_t& message) {
  message.tracks = as_signed(report.tracks);
  message.slam_features = as_signed(report.slam_features);
  message.slam_used = as_signed(report.slam_used);
  message.slam_rejected = as_signed(report.slam_rejected);
  message.slam_added = as_signed(report.slam_added);
  message.slam_nis = report.slam_nis;
  message.msckf_used = as_signed(report.msckf_used);
  message.msckf_rejected = as_signed(report.msckf_rejected);
  message.track_nis = report.track_nis;
  message.track_rows = as_signed(report.track_rows);
  message.ranged_used = as_signed(report.ranged_used);
  message.ranged_rejected = as_signed(report.ranged_rejected);
  message.ranged_nis = report.ranged_nis;
  message.ranged_judged = as_signed(report.ranged_judged);
  message.ranges_used = as_signed(report.ranges_used);
  message.range_outcome = static_cast<std::int8_t>(report.range_outcome);
  for (std::size_t i = 0; i < report.range_facet.size(); ++i) message.range_facet[i] = as_signed(report.range_facet[i]);
  message.range_feature = as_signed(report.range_feature);
  message.range_measured_m = report.range_measured_m;
  message.range_predicted_m = report.range_predicted_m;
  message.range_sigma_m = report.range_sigma_m;
  message.zero_velocity = report.zero_velocity ? 1 : 0;
  message.directions_used = as_signed(report.directions_used);
}

void fill_counters(const EstimatorCounters& counters, nav_health_t& message) {
  message.imu_samples = as_signed(counters.imu_samples);
  message.imu_out_of_order = as_signed(counters.imu_out_of_order);
  message.imu_invalid = as_signed(counters.imu_invalid);
  message.imu_gaps = as_signed(counters.imu_gaps);
  message.imu_overflow = as_signed(counters.imu_overflow);
  message.frames = as_signed(counters.frames);
  message.frames_out_of_order = as_signed(counters.frames_out_of_order);
  message.frames_without_imu = as_signed(counters.frames_without_imu);
  message.ranges = as_signed(counters.ranges);
  message.ranges_used = as_signed(counters.ranges_used);
  message.ranges_feature = as_signed(counters.ranges_feature);
  message.ranges_spare = as_signed(counters.ranges_spare);
  message.ranges_gated = as_signed(counters.ranges_gated);
  message.ranges_no_facet = as_signed(counters.ranges_no_facet);
  message.ranges_bad_geometry = as_signed(counters.ranges_bad_geometry);
  message.ranges_stale = as_signed(counters.ranges_stale);
  message.ranges_invalid = as_signed(counters.ranges_invalid);
  message.directions = as_signed(counters.directions);
  message.directions_used = as_signed(counters.directions_used);
  message.directions_gated = as_signed(counters.directions_gated);
  message.directions_spare = as_signed(counters.directions_spare);
  message.directions_invalid = as_signed(counters.directions_invalid);
  message.numerical_faults = as_signed(counters.numerical_faults);
  message.resets = as_signed(counters.resets);
}

void fill_commands(const InputFrame& frame, input_frame_t& message) {
  static_assert(std::size(decltype(message.commands){}) == kMaxCommandsPerFrame,
                "input.lcm has the capacity of InputFrame");
  message.command_count = static_cast<std::int32_t>(frame.commands.size());
  for (std::size_t i = 0; i < frame.commands.size(); ++i) {
    const Command& command = frame.commands[i];
    command_record_t& record = message.commands[i];
    record.source = as_signed(command.source);
    record.sequence = as_signed(command.sequence);
    record.id = static_cast<std::int16_t>(command.id);
    copy(command.arguments, record.arguments);
    record.verdict = static_cast<std::int8_t>(command.verdict);
  }
}

}  // namespace

Result<std::size_t> encode(const NavStateRecord& record, MessageBuffer buffer) {
  const NavState& state = record.state;
  nav_state_t message{};
  message.time_ns = record.t_image.ns();
  message.sequence = as_signed(record.sequence);
  message.valid = record.status.valid ? 1 : 0;
  message.mode = static_cast<std::int8_t>(record.status.mode);
  message.reliable_for_s = record.status.reliable_for_s;
  message.vision_time_ns = state.t_vision.ns();
  message.range_time_ns = state.t_range.ns();
  message.heading_known = state.heading_known ? 1 : 0;
  message.reset_count = as_signed(state.reset_count);
  copy(state.p_WI_m, message.p_WI_m);
  copy(state.v_WI_m_s, message.v_WI_m_s);
  copy(state.q_WI, message.q_WI);
  copy(state.b_gyro_rad_s, message.b_gyro_rad_s);
  copy(state.b_accel_m_s2, message.b_accel_m_s2);
  copy(state.covariance, message.covariance);
  fill_report(record.report, message);
  message.state_hash = as_signed(record.state_hash);
  return write(message, buffer);
}

Result<std::size_t> encode(const PredictedState& state, MessageBuffer buffer) {
  nav_output_t message{};
  message.time_ns = state.t.ns();
  message.valid = state.status.valid ? 1 : 0;
  message.mode = static_cast<std::int8_t>(state.status.mode);
  message.reliable_for_s = state.status.reliable_for_s;
  message.reset_count = as_signed(state.reset_count);
  copy(state.p_WI_m, message.p_WI_m);
  copy(state.v_WI_m_s, message.v_WI_m_s);
  copy(state.q_WI, message.q_WI);
  return write(message, buffer);
}

Result<std::size_t> encode(const HealthRecord& record, MessageBuffer buffer) {
  nav_health_t message{};
  message.time_ns = record.t.ns();
  fill_counters(record.estimator, message);
  message.ticks = as_signed(record.system.ticks);
  message.ticks_out_of_order = as_signed(record.system.ticks_out_of_order);
  message.samples_ahead = as_signed(record.system.samples_ahead);
  message.camera_frames = as_signed(record.system.frames);
  message.camera_frames_skipped = as_signed(record.system.frames_skipped);
  message.camera_frames_refused = as_signed(record.system.frames_refused);
  message.predictor_corrections = as_signed(record.predictor.corrections);
  message.predictor_stale_corrections = as_signed(record.predictor.stale_corrections);
  message.predictor_refused_samples = as_signed(record.predictor.refused_samples);
  message.predictor_gaps = as_signed(record.predictor.gaps);
  message.predictor_jump_m = record.tracking.position_m;
  message.predictor_jump_m_s = record.tracking.velocity_m_s;
  message.predictor_jump_rad = record.tracking.attitude_rad;
  copy(record.calibration.value, message.calibration);
  copy(record.calibration.sigma, message.calibration_sigma);
  message.pixel_noise_px = record.pixel_noise_px;
  message.commanded_resets = as_signed(record.system.commanded_resets);
  message.valid = record.status.valid ? 1 : 0;
  message.mode = static_cast<std::int8_t>(record.status.mode);
  message.reliable_for_s = record.status.reliable_for_s;
  static_assert(std::size(decltype(message.sensors){}) == kSensorNames.size(), "navigation.lcm lists every sensor");
  for (std::size_t i = 0; i < record.sensors.size(); ++i) {
    const SensorHealth& health = record.sensors[i];
    message.sensors[i].state = static_cast<std::int8_t>(health.state);
    message.sensors[i].rate_hz = health.rate_hz;
    message.sensors[i].last_ns = health.t_last.ns();
    message.sensors[i].refused_in_a_row = as_signed(health.refused_in_a_row);
    message.sensors[i].samples = as_signed(health.samples);
    message.sensors[i].refused = as_signed(health.refused);
  }
  return write(message, buffer);
}

Result<std::size_t> encode(const TimingRecord& record, MessageBuffer buffer) {
  timing_t message{};
  static_assert(sizeof message.stage_ns == kStageCount * sizeof(std::int64_t), "navigation.lcm lists every stage");
  message.time_ns = record.t_image.ns();
  message.sequence = as_signed(record.sequence);
  std::copy(record.stage_ns.begin(), record.stage_ns.end(), message.stage_ns);
  message.step_ns = record.step_ns;
  return write(message, buffer);
}

Result<std::size_t> encode(const InputFrame& frame, MessageBuffer buffer) {
  input_frame_t message{};
  static_assert(std::size(decltype(message.imu){}) == kMaxImuPerFrame, "input.lcm has the capacity of InputFrame");
  static_assert(std::size(decltype(message.range){}) == kMaxRangePerFrame, "input.lcm has the capacity of InputFrame");
  static_assert(std::size(decltype(message.direction){}) == kMaxDirectionPerFrame,
                "input.lcm has the capacity of InputFrame");
  message.tick = as_signed(frame.tick);
  message.time_ns = frame.t.ns();
  message.handover = static_cast<std::int8_t>(frame.handover);
  message.image_skipped = frame.image_skipped ? 1 : 0;
  message.nav_missed = frame.nav_missed ? 1 : 0;
  message.imu_count = static_cast<std::int32_t>(frame.imu.size());
  for (std::size_t i = 0; i < frame.imu.size(); ++i) {
    message.imu[i].time_ns = frame.imu[i].t.ns();
    copy(frame.imu[i].gyro_rad_s, message.imu[i].gyro_rad_s);
    copy(frame.imu[i].accel_m_s2, message.imu[i].accel_m_s2);
  }
  message.range_count = static_cast<std::int32_t>(frame.range.size());
  for (std::size_t i = 0; i < frame.range.size(); ++i) {
    message.range[i].time_ns = frame.range[i].t.ns();
    message.range[i].range_m = frame.range[i].range_m;
    message.range[i].quality = static_cast<std::int8_t>(frame.range[i].quality);
  }
  message.direction_count = static_cast<std::int32_t>(frame.direction.size());
  for (std::size_t i = 0; i < frame.direction.size(); ++i) {
    message.direction[i].time_ns = frame.direction[i].t.ns();
    message.direction[i].source = static_cast<std::int8_t>(frame.direction[i].source);
    copy(frame.direction[i].seen_I, message.direction[i].seen_I);
    copy(frame.direction[i].known_W, message.direction[i].known_W);
  }
  fill_commands(frame, message);
  message.has_camera = frame.has_camera ? 1 : 0;
  message.camera_time_ns = frame.has_camera ? frame.camera.t_exposure_mid.ns() : 0;
  message.camera_sequence = as_signed(frame.camera.sequence);
  return write(message, buffer);
}

Result<std::size_t> encode(const CameraCalibration& camera, const SensorCalibration& sensor, MessageBuffer buffer) {
  calibration_t message{};
  message.width = camera.width;
  message.height = camera.height;
  message.fx = camera.fx;
  message.fy = camera.fy;
  message.cx = camera.cx;
  message.cy = camera.cy;
  message.distortion = static_cast<std::int8_t>(camera.distortion);
  copy(camera.coefficients, message.coefficients);
  copy(std::array<double, 4>{sensor.q_IC.w(), sensor.q_IC.x(), sensor.q_IC.y(), sensor.q_IC.z()}, message.q_IC);
  copy(sensor.p_IC_m, message.p_IC_m);
  copy(sensor.p_CR_m, message.p_CR_m);
  copy(sensor.u_C, message.u_C);
  message.focal_px = sensor.focal_px;
  message.half_fov_x = sensor.half_fov_x;
  message.half_fov_y = sensor.half_fov_y;
  return write(message, buffer);
}

Result<std::size_t> encode(const ParamsRecord& params, MessageBuffer buffer) {
  params_t message{};
  copy(params.configuration, message.configuration);
  message.count = static_cast<std::int32_t>(params.values.size());
  for (std::size_t i = 0; i < params.values.size(); ++i) {
    copy(params.values[i].name, message.values[i].name);
    message.values[i].value = params.values[i].value;
  }
  return write(message, buffer);
}

Result<std::size_t> encode_truth(const NavState& truth, MessageBuffer buffer) {
  truth_t message{};
  message.time_ns = truth.t.ns();
  copy(truth.p_WI_m, message.p_WI_m);
  copy(truth.v_WI_m_s, message.v_WI_m_s);
  copy(truth.q_WI, message.q_WI);
  copy(truth.b_gyro_rad_s, message.b_gyro_rad_s);
  copy(truth.b_accel_m_s2, message.b_accel_m_s2);
  return write(message, buffer);
}

}  // namespace plumb
