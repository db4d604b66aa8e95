#include "fsw/telemetry/messages.h"

#include <gtest/gtest.h>

#include <cstring>
#include <vector>

#include "fsw/base/crc32.h"
#include "fsw/telemetry/command_messages.h"
#include "plumb_lcm/plumb/command_ack_t.hpp"
#include "plumb_lcm/plumb/command_t.hpp"
#include "plumb_lcm/plumb/input_frame_t.hpp"
#include "plumb_lcm/plumb/nav_health_t.hpp"
#include "plumb_lcm/plumb/nav_output_t.hpp"
#include "plumb_lcm/plumb/nav_state_t.hpp"
#include "plumb_lcm/plumb/timing_t.hpp"
#include "test/support/aggregate.h"
#include "test/unit/telemetry/sample_records.h"

namespace plumb {
namespace {

using test::sample_camera;
using test::sample_health;
using test::sample_input;
using test::sample_nav_state;
using test::sample_sensors;
using test::sample_timing;

template <class... Record>
std::vector<std::uint8_t> encoded(const Record&... record) {
  std::vector<std::uint8_t> buffer(kMaxMessageBytes);
  const Result<std::size_t> size = encode(record..., MessageBuffer(buffer));
  EXPECT_TRUE(size.has_value());
  buffer.resize(size.value());
  return buffer;
}

// What a receiver that knows only the .lcm files reads.
template <class Message>
Message received(const std::vector<std::uint8_t>& bytes) {
  Message message{};
  EXPECT_EQ(message.decode(bytes.data(), 0, static_cast<int>(bytes.size())), static_cast<int>(bytes.size()));
  return message;
}

TEST(Messages, NavStateComesBackWhole) {
  const NavStateRecord sent = sample_nav_state();
  NavStateRecord back;
  ASSERT_EQ(decode(encoded(sent), back), Status::kOk);
  EXPECT_EQ(back.t_image, sent.t_image);
  EXPECT_EQ(back.sequence, sent.sequence);
  EXPECT_EQ(back.state_hash, sent.state_hash);
  EXPECT_EQ(back.state.valid, sent.state.valid);
  EXPECT_EQ(back.status.mode, sent.status.mode);
  EXPECT_EQ(back.status.reliable_for_s, sent.status.reliable_for_s);
  EXPECT_EQ(back.state.t_vision, sent.state.t_vision);
  EXPECT_EQ(back.state.t_range, sent.state.t_range);
  EXPECT_EQ(back.state.reset_count, sent.state.reset_count);
  EXPECT_EQ(back.state.p_WI_m, sent.state.p_WI_m);
  EXPECT_EQ(back.state.v_WI_m_s, sent.state.v_WI_m_s);
  EXPECT_EQ(back.state.q_WI, sent.state.q_WI);
  EXPECT_EQ(back.state.b_gyro_rad_s, sent.state.b_gyro_rad_s);
  EXPECT_EQ(back.state.b_accel_m_s2, sent.state.b_accel_m_s2);
  EXPECT_EQ(back.state.covariance, sent.state.covariance);
  EXPECT_EQ(back.report.msckf_rejected, sent.report.msckf_rejected);
  EXPECT_EQ(back.report.range_outcome, sent.report.range_outcome);
  EXPECT_EQ(back.report.range_facet, sent.report.range_facet);
  EXPECT_EQ(back.report.zero_velocity, sent.report.zero_velocity);
  EXPECT_EQ(back.report.directions_used, sent.report.directions_used);
  EXPECT_EQ(back.report.heading_known, sent.report.heading_known);
  EXPECT_EQ(back.state.heading_known, sent.state.heading_known);
}

TEST(Messages, NavStateReachesAReceiverFieldByField) {
  const auto message = received<nav_state_t>(encoded(sample_nav_state()));
  EXPECT_EQ(message.time_ns, 1'403'636'584'763'555'584);
  EXPECT_EQ(message.mode, 2);
  EXPECT_EQ(message.p_WI_m[2], 1e-300);
  EXPECT_EQ(message.q_WI[1], -0.5);
  EXPECT_EQ(message.covariance[224], 1.0 / 225.0);
  EXPECT_EQ(message.tracks, 1);
  EXPECT_EQ(message.slam_features, 2);
  EXPECT_EQ(message.slam_used, 3);
  EXPECT_EQ(message.slam_rejected, 4);
  EXPECT_EQ(message.slam_added, 5);
  EXPECT_EQ(message.slam_nis, 13.5);
  EXPECT_EQ(message.msckf_used, 6);
  EXPECT_EQ(message.track_nis, 90.5);
  EXPECT_EQ(message.track_rows, 91);
  EXPECT_EQ(message.ranged_nis, 16.5);
  EXPECT_EQ(message.ranged_judged, 17);
  EXPECT_EQ(message.ranges_used, 8);
  EXPECT_EQ(message.range_outcome, 4);
  EXPECT_EQ(message.range_facet[0], 21);
  EXPECT_EQ(message.range_measured_m, 9.5);
  EXPECT_EQ(message.range_predicted_m, 10.5);
  EXPECT_EQ(message.range_sigma_m, 11.5);
}

// A record that has grown a member needs it in navigation.lcm, encode.cpp, decode.cpp, tools/replay/report_fields.h and
// here.
TEST(Messages, CarryEveryMemberOfTheRecords) {
  EXPECT_EQ(test::member_count<FrameReport>(), 24U);
  EXPECT_EQ(test::member_count<EstimatorCounters>(), 24U);
  EXPECT_EQ(test::member_count<NavSystemCounters>(), 7U);
  EXPECT_EQ(test::member_count<PredictorCounters>(), 4U);
  EXPECT_EQ(test::member_count<PredictorTracking>(), 3U);
}

TEST(Messages, HealthTimingAndOutputReachAReceiver) {
  const auto health = received<nav_health_t>(encoded(sample_health()));
  EXPECT_EQ(health.time_ns, 77);
  EXPECT_EQ(static_cast<std::uint64_t>(health.imu_samples), 0x8000000000000001U);
  EXPECT_EQ(health.resets, 3);
  EXPECT_EQ(health.samples_ahead, 6);
  EXPECT_EQ(health.camera_frames_refused, 4);
  EXPECT_EQ(health.predictor_gaps, 5);
  EXPECT_EQ(health.predictor_jump_rad, 0.125);
  EXPECT_EQ(health.calibration[6], 0.003);
  EXPECT_EQ(health.calibration_sigma[17], 0.002);
  EXPECT_EQ(health.pixel_noise_px, 0.75);
  EXPECT_EQ(health.commanded_resets, 2);
  EXPECT_EQ(health.valid, 1);
  EXPECT_EQ(health.mode, 4);
  EXPECT_EQ(health.reliable_for_s, 1.75);
  EXPECT_EQ(health.sensors[2].state, 2);
  EXPECT_EQ(health.sensors[2].rate_hz, 24.5);
  EXPECT_EQ(health.sensors[2].last_ns, 71);
  EXPECT_EQ(health.sensors[2].refused_in_a_row, 72);
  EXPECT_EQ(health.sensors[2].samples, 73);
  EXPECT_EQ(health.sensors[2].refused, 74);
  const auto timing = received<timing_t>(encoded(sample_timing()));
  EXPECT_EQ(timing.stage_ns[0], 10);
  EXPECT_EQ(timing.stage_ns[kStageCount - 1], static_cast<std::int64_t>(9 + kStageCount));
  EXPECT_EQ(timing.step_ns, 1000);
  const PredictedState state{.t = Time::from_ns(3),
                             .p_WI_m = {1, 2, 3},
                             .v_WI_m_s = {4, 5, 6},
                             .q_WI = {0, 1, 0, 0},
                             .reset_count = 7,
                             .status = {.valid = true, .mode = NavMode::kInertial, .reliable_for_s = 2.5}};
  const auto output = received<nav_output_t>(encoded(state));
  EXPECT_EQ(output.time_ns, 3);
  EXPECT_EQ(output.v_WI_m_s[2], 6.0);
  EXPECT_EQ(output.q_WI[1], 1.0);
  EXPECT_EQ(output.reset_count, 7);
  EXPECT_EQ(output.valid, 1);
  EXPECT_EQ(output.mode, 3);
  EXPECT_EQ(output.reliable_for_s, 2.5);
}

TEST(Messages, InputFrameComesBackBitByBit) {
  const InputFrame sent = sample_input();
  InputFrame back;
  ASSERT_EQ(decode(encoded(sent), back), Status::kOk);
  EXPECT_EQ(back.tick, sent.tick);
  EXPECT_EQ(back.t, sent.t);
  ASSERT_EQ(back.imu.size(), sent.imu.size());
  for (std::size_t i = 0; i < sent.imu.size(); ++i) {
    EXPECT_EQ(back.imu[i].t, sent.imu[i].t);
    EXPECT_EQ(back.imu[i].gyro_rad_s, sent.imu[i].gyro_rad_s);
    EXPECT_EQ(back.imu[i].accel_m_s2, sent.imu[i].accel_m_s2);
  }
  ASSERT_EQ(back.range.size(), sent.range.size());
  EXPECT_EQ(back.range[0].range_m, 12.5);
  EXPECT_EQ(back.range[1].quality, RangeQuality::kWeak);
  ASSERT_EQ(back.direction.size(), 1U);
  EXPECT_EQ(back.direction[0].t, sent.direction[0].t);
  EXPECT_EQ(back.direction[0].source, DirectionSource::kMagnetometer);
  EXPECT_EQ(back.direction[0].seen_I, sent.direction[0].seen_I);
  EXPECT_EQ(back.direction[0].known_W, sent.direction[0].known_W);
  ASSERT_EQ(back.commands.size(), 1U);
  EXPECT_EQ(back.commands[0].source, sent.commands[0].source);
  EXPECT_EQ(back.commands[0].sequence, sent.commands[0].sequence);
  EXPECT_EQ(back.commands[0].id, sent.commands[0].id);
  EXPECT_EQ(back.commands[0].arguments, sent.commands[0].arguments);
  EXPECT_EQ(back.commands[0].verdict, sent.commands[0].verdict);
  EXPECT_TRUE(back.has_camera);
  EXPECT_EQ(back.handover, Handover::kReleased);
  EXPECT_TRUE(back.image_skipped);
  EXPECT_TRUE(back.nav_missed);
  EXPECT_EQ(back.camera.t_exposure_mid, sent.camera.t_exposure_mid);
  EXPECT_EQ(back.camera.sequence, sent.camera.sequence);
}

TEST(Messages, NotANumberSurvivesTheInputFrame) {
  InputFrame sent = sample_input();
  const std::uint64_t bits = 0x7ff8000000001234U;  // a quiet not-a-number with a payload
  std::memcpy(&sent.imu[0].gyro_rad_s[0], &bits, sizeof bits);
  InputFrame back;
  ASSERT_EQ(decode(encoded(sent), back), Status::kOk);
  EXPECT_EQ(std::memcmp(&back.imu[0].gyro_rad_s[0], &bits, sizeof bits), 0);
}

TEST(Messages, CalibrationComesBack) {
  const std::vector<std::uint8_t> bytes = encoded(sample_camera(), sample_sensors());
  CameraCalibration camera;
  SensorCalibration sensors;
  ASSERT_EQ(decode(bytes, camera, sensors), Status::kOk);
  EXPECT_EQ(camera.width, 752);
  EXPECT_EQ(camera.cy, 248.0);
  EXPECT_EQ(camera.distortion, Distortion::kEquidistant);
  EXPECT_EQ(camera.coefficients, sample_camera().coefficients);
  EXPECT_EQ(sensors.q_IC.coeffs(), sample_sensors().q_IC.coeffs());
  EXPECT_EQ(sensors.p_IC_m, sample_sensors().p_IC_m);
  EXPECT_EQ(sensors.p_CR_m, sample_sensors().p_CR_m);
  EXPECT_EQ(sensors.u_C, sample_sensors().u_C);
  EXPECT_EQ(sensors.half_fov_y, 0.75);
}

TEST(Messages, CalibrationThatIsNoneIsRefused) {
  CameraCalibration camera;
  SensorCalibration sensors;
  SensorCalibration bent = sample_sensors();
  bent.u_C = Vec3(0.0, 0.0, 2.0);
  EXPECT_EQ(decode(encoded(sample_camera(), bent), camera, sensors), Status::kInvalidValue);
  for (double SensorCalibration::* member :
       {&SensorCalibration::focal_px, &SensorCalibration::half_fov_x, &SensorCalibration::half_fov_y}) {
    SensorCalibration blind = sample_sensors();
    blind.*member = 0.0;
    EXPECT_EQ(decode(encoded(sample_camera(), blind), camera, sensors), Status::kInvalidValue);
  }
  CameraCalibration flat = sample_camera();
  flat.fx = 0.0;
  EXPECT_EQ(decode(encoded(flat, sample_sensors()), camera, sensors), Status::kInvalidValue);
}

TEST(Messages, ParamsComeBack) {
  ParamsRecord sent;
  std::strcpy(sent.configuration.data(), "paper");
  ParamValue value{.value = 0.1};
  std::strcpy(value.name.data(), "imu.gravity");
  ASSERT_EQ(sent.values.push_back(value), Status::kOk);
  ParamsRecord back;
  ASSERT_EQ(decode(encoded(sent), back), Status::kOk);
  EXPECT_STREQ(back.configuration.data(), "paper");
  ASSERT_EQ(back.values.size(), 1U);
  EXPECT_STREQ(back.values[0].name.data(), "imu.gravity");
  EXPECT_EQ(back.values[0].value, 0.1);
}

TEST(Messages, TruthComesBack) {
  const NavState sent = sample_nav_state().state;
  std::vector<std::uint8_t> buffer(kMaxMessageBytes);
  const Result<std::size_t> size = encode_truth(sent, buffer);
  ASSERT_TRUE(size.has_value());
  NavState back;
  ASSERT_EQ(decode_truth({buffer.data(), *size}, back), Status::kOk);
  EXPECT_EQ(back.t, sent.t);
  EXPECT_EQ(back.p_WI_m, sent.p_WI_m);
  EXPECT_EQ(back.q_WI, sent.q_WI);
  EXPECT_EQ(back.b_accel_m_s2, sent.b_accel_m_s2);
}

TEST(Messages, TruthThatIsNoneIsRefused) {
  NavState longer = sample_nav_state().state;
  longer.q_WI[0] += 0.5;
  NavState nowhere = sample_nav_state().state;
  nowhere.p_WI_m[1] = std::nan("");
  for (const NavState& bad : {longer, nowhere}) {
    std::vector<std::uint8_t> buffer(kMaxMessageBytes);
    const Result<std::size_t> size = encode_truth(bad, buffer);
    ASSERT_TRUE(size.has_value());
    NavState back;
    EXPECT_EQ(decode_truth({buffer.data(), *size}, back), Status::kInvalidValue);
  }
}

TEST(Messages, EveryShortenedOrLengthenedMessageIsRefused) {
  const std::vector<std::uint8_t> whole = encoded(sample_input());
  InputFrame frame;
  for (std::size_t size = 0; size < whole.size(); ++size) {
    ASSERT_EQ(decode(MessageBytes(whole.data(), size), frame), Status::kInvalidValue) << size;
  }
  std::vector<std::uint8_t> longer = whole;
  longer.push_back(0);
  EXPECT_EQ(decode(longer, frame), Status::kInvalidValue);
  NavStateRecord other_type;
  EXPECT_EQ(decode(whole, other_type), Status::kInvalidValue);
}

TEST(Messages, CountsOutOfRangeAreRefused) {
  auto message = received<input_frame_t>(encoded(sample_input()));
  std::vector<std::uint8_t> buffer(kMaxMessageBytes);
  const auto decode_changed = [&] {
    const int size = message.encode(buffer.data(), 0, static_cast<int>(buffer.size()));
    InputFrame frame;
    return decode(MessageBytes(buffer.data(), static_cast<std::size_t>(size)), frame);
  };
  EXPECT_EQ(decode_changed(), Status::kOk);
  message.imu_count = static_cast<std::int32_t>(kMaxImuPerFrame) + 1;
  EXPECT_EQ(decode_changed(), Status::kInvalidValue);
  message.imu_count = -1;
  EXPECT_EQ(decode_changed(), Status::kInvalidValue);
  message.imu_count = 0;
  message.range[0].quality = 3;
  EXPECT_EQ(decode_changed(), Status::kInvalidValue);
  message.range[0].quality = 0;
  message.direction_count = static_cast<std::int32_t>(kMaxDirectionPerFrame) + 1;
  EXPECT_EQ(decode_changed(), Status::kInvalidValue);
  message.direction_count = 1;
  message.direction[0].source = 2;
  EXPECT_EQ(decode_changed(), Status::kInvalidValue);
  message.direction[0].source = 1;
  message.command_count = static_cast<std::int32_t>(kMaxCommandsPerFrame) + 1;
  EXPECT_EQ(decode_changed(), Status::kInvalidValue);
  message.command_count = 1;
  message.commands[0].verdict = 9;
  EXPECT_EQ(decode_changed(), Status::kInvalidValue);
  message.commands[0].verdict = 8;
  message.has_camera = 2;
  EXPECT_EQ(decode_changed(), Status::kInvalidValue);
  message.has_camera = 1;
  message.handover = 4;
  EXPECT_EQ(decode_changed(), Status::kInvalidValue);
}

TEST(Messages, ACommandComesWholeOrNotAtAll) {
  command_t sent{.source = -5, .sequence = 6, .id = 2, .arguments = {1.5, 2.5, 3.5, 4.5}, .crc = 0};
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(sent.getEncodedSize()));
  const auto encode_sent = [&] { return sent.encode(bytes.data(), 0, static_cast<int>(bytes.size())); };
  encode_sent();
  sent.crc = static_cast<std::int32_t>(crc32(MessageBytes(bytes).first(bytes.size() - 4)));
  encode_sent();
  Command command;
  ASSERT_EQ(decode(bytes, command), Status::kOk);
  EXPECT_EQ(command.source, 0xfffffffbU);
  EXPECT_EQ(command.sequence, 6U);
  EXPECT_EQ(command.id, 2);
  EXPECT_EQ(command.arguments, (std::array<double, 4>{1.5, 2.5, 3.5, 4.5}));
  EXPECT_EQ(command.verdict, CommandVerdict::kAccepted);
  for (std::size_t i = 8; i < bytes.size(); ++i) {
    std::vector<std::uint8_t> damaged = bytes;
    damaged[i] ^= 0x10;
    ASSERT_EQ(decode(damaged, command), Status::kOk);
    EXPECT_EQ(command.verdict, CommandVerdict::kChecksum);
  }
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_EQ(decode(MessageBytes(bytes.data(), size), command), Status::kInvalidValue);
  }
}

TEST(Messages, AnAnswerReachesWhoeverAsked) {
  const CommandAck sent{.t = Time::from_ns(9), .command = sample_input().commands[0]};
  const auto ack = received<command_ack_t>(encoded(sent));
  EXPECT_EQ(ack.time_ns, 9);
  EXPECT_EQ(static_cast<std::uint32_t>(ack.source), sent.command.source);
  EXPECT_EQ(static_cast<std::uint32_t>(ack.sequence), sent.command.sequence);
  EXPECT_EQ(static_cast<std::uint16_t>(ack.id), sent.command.id);
  EXPECT_EQ(ack.verdict, 3);
}

TEST(Messages, ABufferThatIsTooSmallIsFull) {
  std::vector<std::uint8_t> buffer(encoded(sample_nav_state()).size());
  EXPECT_TRUE(encode(sample_nav_state(), MessageBuffer(buffer)).has_value());
  EXPECT_EQ(encode(sample_nav_state(), MessageBuffer(buffer.data(), buffer.size() - 1)).status(), Status::kFull);
  EXPECT_EQ(encode(sample_nav_state(), MessageBuffer()).status(), Status::kFull);
}

}  // namespace
}  // namespace plumb
