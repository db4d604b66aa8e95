#include "test/faults/observer.h"

#include <cmath>
#include <stdexcept>
#include <string_view>

#include "fsw/app/flight_schedule.h"
#include "fsw/app/parameters.h"
#include "fsw/events/device_faults.h"
#include "fsw/events/event.h"
#include "fsw/measurement/command.h"
#include "fsw/modes/mode_machine.h"
#include "fsw/modes/sensor_health.h"
#include "fsw/telemetry/executive_messages.h"
#include "fsw/telemetry/messages.h"
#include "plumb_lcm/plumb/event_t.hpp"
#include "plumb_lcm/plumb/nav_output_t.hpp"
#include "test/faults/heap_meter.h"

namespace plumb::faults {
namespace {

template <class Message>
Message decoded(std::span<const std::uint8_t> bytes) {
  Message message{};
  if (message.decode(bytes.data(), 0, static_cast<int>(bytes.size())) < 0) throw std::runtime_error("bad telemetry");
  return message;
}

template <class Table>
std::string name_in(const Table& table, std::int64_t state) {
  for (const auto& row : table) {
    if (static_cast<std::int64_t>(row.state) == state) return std::string(row.name);
  }
  return "unknown";
}

/// "STIM300 counts checksum_errors"
std::string fault_words(FaultyDevice device, std::int64_t counter) {
  const auto index = static_cast<std::size_t>(device);
  return std::string(kFaultyDeviceNames[index]) + kCounts +
         std::string(kDeviceFaultTables[index][static_cast<std::size_t>(counter)].name);
}

std::string words_of(const event_t& event) {
  constexpr std::array<const char*, 9> kVerdicts{"accepted",          "refused: checksum", "refused: no such command",
                                                 "refused: argument", "refused: repeated", "refused: other table",
                                                 "refused: range",    "refused: conflict", "refused: not in flight"};
  constexpr std::array<const char*, 5> kDamages{"sound", "mended", "standby mended", "checksum mended", "lost"};
  const auto job = [&event] { return std::string(kFlightSchedule[static_cast<std::size_t>(event.arguments[0])].name); };
  switch (static_cast<EventId>(event.id)) {
    case EventId::kJobOverrun: return "overrun of " + job();
    case EventId::kJobSlip: return "slip of " + job();
    case EventId::kResultLate: return "result late";
    case EventId::kImageSkipped: return "image skipped";
    case EventId::kNavMissed: return "frame that nav missed";
    case EventId::kParametersDamaged:
      return std::string(event.arguments[0] == 0 ? "tick" : "nav") + " parameters " +
             kDamages[static_cast<std::size_t>(event.arguments[1])];
    case EventId::kDeviceFaults: break;
    case EventId::kDeviceFault: return fault_words(static_cast<FaultyDevice>(event.arguments[0]), event.arguments[1]);
    case EventId::kModeChanged: return "mode " + name_in(kModeTable, event.arguments[1]);
    case EventId::kSensorChanged:
      return std::string(kSensorNames[static_cast<std::size_t>(event.arguments[0])]) + " " +
             name_in(kSensorTable, event.arguments[2]);
    case EventId::kFilterReset: return "filter reset";
    case EventId::kParameterSet:
      return std::string(parameter_table().rows()[static_cast<std::size_t>(event.arguments[0])].name) + " set";
    case EventId::kCommand: return std::string("command ") + kVerdicts[static_cast<std::size_t>(event.arguments[3])];
  }
  return "event " + std::to_string(event.id);
}

double length(double x, double y, double z) { return std::sqrt(x * x + y * y + z * z); }

}  // namespace

Status Observer::publish(const char* channel, std::span<const std::uint8_t> message) {
  const TestScope scope;
  const std::string_view name(channel);
  if (name == channel::kNavOutput) see_output(message);
  if (name == channel::kEvents) see_event(message);
  if (name == channel::kNavState) see_state(message);
  return Status::kOk;
}

void Observer::see_output(std::span<const std::uint8_t> message) {
  const auto said = decoded<nav_output_t>(message);
  const double t_world_s = world_s(said.time_ns);
  SeenOutput output{.t_s = told_s(t_world_s),
                    .age_s = told_s(t_world_s) - (t_world_s - t_start_s_),
                    .valid = said.valid != 0,
                    .mode = static_cast<NavMode>(said.mode),
                    .reliable_for_s = said.reliable_for_s,
                    .reset_count = said.reset_count};
  if (output.valid) {
    const double* q = said.q_WI;
    const double heading_rad = std::atan2(2.0 * (q[0] * q[3] + q[1] * q[2]), 1.0 - 2.0 * (q[2] * q[2] + q[3] * q[3]));
    compare(t_world_s, {said.p_WI_m[0], said.p_WI_m[1], said.p_WI_m[2]},
            {said.v_WI_m_s[0], said.v_WI_m_s[1], said.v_WI_m_s[2]}, heading_rad, output);
  }
  seen_.outputs.push_back(output);
}

void Observer::compare(double t_world_s, const Vector& p_m, const Vector& v_m_s, double heading_rad,
                       SeenOutput& output) {
  const Vector p_true_m = flight_.position_m(t_world_s);
  const Vector v_true_m_s = flight_.velocity_m_s(t_world_s);
  if (!start_.known || start_.reset_count != output.reset_count) {
    start_ = {.known = true,
              .reset_count = output.reset_count,
              .turn_rad = flight_.heading_rad(t_world_s) - heading_rad,
              .p_m = p_m,
              .p_true_m = p_true_m};
  }
  const double c = std::cos(start_.turn_rad);
  const double s = std::sin(start_.turn_rad);
  const double x = p_m[0] - start_.p_m[0];
  const double y = p_m[1] - start_.p_m[1];
  output.position_error_m =
      length(c * x - s * y - (p_true_m[0] - start_.p_true_m[0]), s * x + c * y - (p_true_m[1] - start_.p_true_m[1]),
             p_m[2] - start_.p_m[2] - (p_true_m[2] - start_.p_true_m[2]));
  output.velocity_error_m_s = length(c * v_m_s[0] - s * v_m_s[1] - v_true_m_s[0],
                                     s * v_m_s[0] + c * v_m_s[1] - v_true_m_s[1], v_m_s[2] - v_true_m_s[2]);
}

void Observer::see_event(std::span<const std::uint8_t> message) {
  const auto said = decoded<event_t>(message);
  seen_.events.push_back({.t_s = told_s(world_s(said.time_ns)), .words = words_of(said)});
}

void Observer::see_state(std::span<const std::uint8_t> message) {
  NavStateRecord record;
  if (!ok(decode(message, record))) throw std::runtime_error("bad telemetry");
  seen_.state_hashes.push_back(record.state_hash);
}

}  // namespace plumb::faults
