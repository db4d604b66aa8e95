#include <algorithm>
#include <cmath>

#include "fsw/math/exact.h"
#include "fsw/telemetry/lcm_codec.h"
#include "plumb_lcm/plumb/calibration_t.hpp"
#include "plumb_lcm/plumb/input_frame_t.hpp"
#include "plumb_lcm/plumb/nav_state_t.hpp"
#include "plumb_lcm/plumb/params_t.hpp"
#include "plumb_lcm/plumb/truth_t.hpp"

namespace plumb {
namespace {

template <std::size_t N>
void copy(const double (&from)[N], std::array<double, N>& to) {
  std::copy(std::begin(from), std::end(from), to.begin());
}

template <std::size_t N>
bool all_finite(const double (&values)[N]) {
  return std::all_of(std::begin(values), std::end(values), [](double value) { return std::isfinite(value); });
}

template <std::size_t N>
Status copy_text(const std::uint8_t (&from)[N], std::array<char, N>& to) {
  if (from[N - 1] != 0) return Status::kInvalidValue;  // not terminated
  for (std::size_t i = 0; i < N; ++i) to[i] = static_cast<char>(from[i]);
  return Status::kOk;
}

template <typename Enum>
bool is_enum(std::int8_t value, Enum last) {
  return value >= 0 && value <= static_cast<std::int8_t>(last);
}

FrameReport report_of(const nav_state_t& message) {
  const auto count = [](std::int32_t value) { return static_cast<std::uint32_t>(value); };
  FrameReport report;
  report.tracks = count(message.tracks);
  report.slam_features = count(message.slam_features);
  report.slam_used = count(message.slam_used);
  report.slam_rejected = count(message.slam_rejected);
  report.slam_added = count(message.slam_added);
  report.slam_nis = message.slam_nis;
  report.msckf_used = count(message.msckf_used);
  report.msckf_rejected = count(message.msckf_rejected);
  report.track_nis = message.track_nis;
  report.track_rows = count(message.track_rows);
  report.ranged_used = count(message.ranged_used);
  report.ranged_rejected = count(message.ranged_rejected);
  report.ranged_nis = message.ranged_nis;
  report.ranged_judged = count(message.ranged_judged);
  report.ranges_used = count(message.ranges_used);
  report.range_outcome = static_cast<RangeOutcome>(message.range_outcome);
  for (std::size_t i = 0; i < report.range_facet.size(); ++i) report.range_facet[i] = count(message.range_facet[i]);
  report.range_feature = count(message.range_feature);
  report.range_measured_m = message.range_measured_m;
  report.range_predicted_m = message.range_predicted_m;
  report.range_sigma_m = message.range_sigma_m;
  report.zero_velocity = message.zero_velocity == 1;
  report.directions_used = count(message.directions_used);
  report.heading_known = message.heading_known == 1;
  return report;
}

bool take_commands(const input_frame_t& message, InputFrame& frame) {
  if (message.command_count < 0 || message.command_count > static_cast<std::int32_t>(kMaxCommandsPerFrame))
    return false;
  frame.commands.resize(static_cast<std::size_t>(message.command_count));
  for (std::size_t i = 0; i < frame.commands.size(); ++i) {
    const command_record_t& record = message.commands[i];
    if (!is_enum(record.verdict, CommandVerdict::kFixed)) return false;
    Command& command = frame.commands[i];
    command.source = static_cast<std::uint32_t>(record.source);
    command.sequence = static_cast<std::uint32_t>(record.sequence);
    command.id = static_cast<std::uint16_t>(record.id);
    copy(record.arguments, command.arguments);
    command.verdict = static_cast<CommandVerdict>(record.verdict);
  }
  return true;
}

}  // namespace

Status decode(MessageBytes bytes, NavStateRecord& record) {
  nav_state_t message{};
  if (!read(bytes, message)) return Status::kInvalidValue;
  const bool in_range = is_flag(message.valid) && is_flag(message.heading_known) && is_flag(message.zero_velocity) &&
                        is_enum(message.mode, NavMode::kInertial) &&
                        is_enum(message.range_outcome, RangeOutcome::kSpare);
  if (!in_range) return Status::kInvalidValue;
  record.t_image = Time::from_ns(message.time_ns);
  record.sequence = static_cast<std::uint32_t>(message.sequence);
  record.state_hash = static_cast<std::uint64_t>(message.state_hash);
  record.report = report_of(message);
  NavState& state = record.state;
  state.t = record.t_image;
  state.valid = record.status.valid = message.valid == 1;
  record.status.mode = static_cast<NavMode>(message.mode);
  record.status.reliable_for_s = message.reliable_for_s;
  state.t_vision = Time::from_ns(message.vision_time_ns);
  state.t_range = Time::from_ns(message.range_time_ns);
  state.heading_known = message.heading_known == 1;
  state.reset_count = static_cast<std::uint32_t>(message.reset_count);
  copy(message.p_WI_m, state.p_WI_m);
  copy(message.v_WI_m_s, state.v_WI_m_s);
  copy(message.q_WI, state.q_WI);
  copy(message.b_gyro_rad_s, state.b_gyro_rad_s);
  copy(message.b_accel_m_s2, state.b_accel_m_s2);
  copy(message.covariance, state.covariance);
  return Status::kOk;
}

Status decode(MessageBytes bytes, InputFrame& frame) {
  input_frame_t message{};
  if (!read(bytes, message)) return Status::kInvalidValue;
  const bool counts_fit =
      message.imu_count >= 0 && message.imu_count <= static_cast<std::int32_t>(kMaxImuPerFrame) &&
      message.range_count >= 0 && message.range_count <= static_cast<std::int32_t>(kMaxRangePerFrame) &&
      message.direction_count >= 0 && message.direction_count <= static_cast<std::int32_t>(kMaxDirectionPerFrame);
  const bool flags_fit = is_flag(message.has_camera) && is_flag(message.image_skipped) && is_flag(message.nav_missed) &&
                         is_enum(message.handover, Handover::kLate);
  if (!counts_fit || !flags_fit || message.tick < 0) return Status::kInvalidValue;
  frame.tick = static_cast<std::uint64_t>(message.tick);
  frame.t = Time::from_ns(message.time_ns);
  frame.handover = static_cast<Handover>(message.handover);
  frame.image_skipped = message.image_skipped == 1;
  frame.nav_missed = message.nav_missed == 1;
  frame.imu.resize(static_cast<std::size_t>(message.imu_count));
  for (std::size_t i = 0; i < frame.imu.size(); ++i) {
    frame.imu[i].t = Time::from_ns(message.imu[i].time_ns);
    copy(message.imu[i].gyro_rad_s, frame.imu[i].gyro_rad_s);
    copy(message.imu[i].accel_m_s2, frame.imu[i].accel_m_s2);
  }
  frame.range.resize(static_cast<std::size_t>(message.range_count));
  for (std::size_t i = 0; i < frame.range.size(); ++i) {
    const range_sample_t& sample = message.range[i];
    if (!is_enum(sample.quality, RangeQuality::kWeak)) return Status::kInvalidValue;
    frame.range[i] = {.t = Time::from_ns(sample.time_ns),
                      .range_m = sample.range_m,
                      .quality = static_cast<RangeQuality>(sample.quality)};
  }
  frame.direction.resize(static_cast<std::size_t>(message.direction_count));
  for (std::size_t i = 0; i < frame.direction.size(); ++i) {
    const direction_sample_t& sample = message.direction[i];
    if (!is_enum(sample.source, DirectionSource::kMagnetometer)) return Status::kInvalidValue;
    frame.direction[i].t = Time::from_ns(sample.time_ns);
    frame.direction[i].source = static_cast<DirectionSource>(sample.source);
    copy(sample.seen_I, frame.direction[i].seen_I);
    copy(sample.known_W, frame.direction[i].known_W);
  }
  if (!take_commands(message, frame)) return Status::kInvalidValue;
  frame.has_camera = message.has_camera == 1;
  frame.camera = {};
  if (frame.has_camera) {
    frame.camera = {.t_exposure_mid = Time::from_ns(message.camera_time_ns),
                    .sequence = static_cast<std::uint32_t>(message.camera_sequence)};
  }
  return Status::kOk;
}

Status decode(MessageBytes bytes, CameraCalibration& camera, SensorCalibration& sensor) {
  calibration_t message{};
  if (!read(bytes, message)) return Status::kInvalidValue;
  if (!is_enum(message.distortion, Distortion::kFov)) return Status::kInvalidValue;
  const bool finite = all_finite(message.q_IC) && all_finite(message.p_IC_m) && all_finite(message.p_CR_m) &&
                      all_finite(message.u_C) && std::isfinite(message.focal_px) && std::isfinite(message.half_fov_x) &&
                      std::isfinite(message.half_fov_y);
  const Quat q_IC(message.q_IC[0], message.q_IC[1], message.q_IC[2], message.q_IC[3]);
  const Vec3 u_C(message.u_C[0], message.u_C[1], message.u_C[2]);
  constexpr double kUnit = 1e-9;  // both were normalised when they were written
  const bool positive = message.focal_px > 0.0 && message.half_fov_x > 0.0 && message.half_fov_y > 0.0;
  if (!finite || !positive || std::abs(q_IC.norm() - 1.0) > kUnit || std::abs(u_C.norm() - 1.0) > kUnit) {
    return Status::kInvalidValue;
  }
  CameraCalibration read_camera{.width = message.width,
                                .height = message.height,
                                .fx = message.fx,
                                .fy = message.fy,
                                .cx = message.cx,
                                .cy = message.cy,
                                .distortion = static_cast<Distortion>(message.distortion)};
  copy(message.coefficients, read_camera.coefficients);
  if (!ok(CameraModel::check(read_camera))) return Status::kInvalidValue;
  camera = read_camera;
  sensor.q_IC = q_IC;
  sensor.p_IC_m = Vec3(message.p_IC_m[0], message.p_IC_m[1], message.p_IC_m[2]);
  sensor.p_CR_m = Vec3(message.p_CR_m[0], message.p_CR_m[1], message.p_CR_m[2]);
  sensor.u_C = u_C;
  sensor.focal_px = message.focal_px;
  sensor.half_fov_x = message.half_fov_x;
  sensor.half_fov_y = message.half_fov_y;
  return Status::kOk;
}

Status decode(MessageBytes bytes, ParamsRecord& params) {
  params_t message{};
  if (!read(bytes, message)) return Status::kInvalidValue;
  if (message.count < 0 || message.count > static_cast<std::int32_t>(kMaxParams)) return Status::kInvalidValue;
  if (!ok(copy_text(message.configuration, params.configuration))) return Status::kInvalidValue;
  params.values.resize(static_cast<std::size_t>(message.count));
  for (std::size_t i = 0; i < params.values.size(); ++i) {
    if (!ok(copy_text(message.values[i].name, params.values[i].name))) return Status::kInvalidValue;
    params.values[i].value = message.values[i].value;
  }
  return Status::kOk;
}

Status decode_truth(MessageBytes bytes, NavState& truth) {
  truth_t message{};
  if (!read(bytes, message)) return Status::kInvalidValue;
  const double norm =
      exact::hypot(exact::hypot(message.q_WI[0], message.q_WI[1]), exact::hypot(message.q_WI[2], message.q_WI[3]));
  constexpr double kUnit = 1e-6;
  if (!all_finite(message.p_WI_m) || !all_finite(message.v_WI_m_s) || !(std::abs(norm - 1.0) < kUnit)) {
    return Status::kInvalidValue;
  }
  truth = {};
  truth.t = Time::from_ns(message.time_ns);
  truth.valid = true;
  copy(message.p_WI_m, truth.p_WI_m);
  copy(message.v_WI_m_s, truth.v_WI_m_s);
  copy(message.q_WI, truth.q_WI);
  copy(message.b_gyro_rad_s, truth.b_gyro_rad_s);
  copy(message.b_accel_m_s2, truth.b_accel_m_s2);
  return Status::kOk;
}

}  // namespace plumb
