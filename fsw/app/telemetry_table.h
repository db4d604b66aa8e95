#pragma once
// What the tick and the nav job tell, when and where: a row for each record. Whoever sends names the record alone, so
// that nothing is sent that has no row. docs/interface.md has it as a table.

#include <cstdint>
#include <string_view>
#include <tuple>

#include "fsw/app/flight_schedule.h"
#include "fsw/telemetry/command_messages.h"
#include "fsw/telemetry/executive_messages.h"
#include "fsw/telemetry/messages.h"

namespace plumb {

enum class SentWhen : std::uint8_t {
  kEachRun = 0,  ///< of its job, once
  kEachSample,   ///< of the IMU, once; in a tick without one at most once
  kEachImage,    ///< that is processed, once
  kOnChange,     ///< as often as something happens
  kOnCommand,    ///< in the tick that takes the command
};

struct SentRecord {
  const char* channel;
  std::string_view type;  ///< of the message, in fsw/telemetry
  FlightJob job;          ///< that sends it
  SentWhen when;
  bool published = true;  ///< over telemetry
  bool logged = true;
};
template <class Record>
struct TelemetryRow : SentRecord {};

// What overran or slipped is told after the job that did, whichever it is.
inline constexpr std::tuple kTelemetry{
    TelemetryRow<InputFrame>{{channel::kInputFrame, "input_frame_t", kJobAssemble, SentWhen::kEachRun,
                              /*published=*/false}},
    TelemetryRow<PredictedState>{{channel::kNavOutput, "nav_output_t", kJobPublish, SentWhen::kEachSample}},
    TelemetryRow<Event>{{channel::kEvents, "event_t", kJobPublish, SentWhen::kOnChange}},
    TelemetryRow<CommandAck>{{channel::kCommandAck, "command_ack_t", kJobPublish, SentWhen::kOnCommand}},
    // Not into the log, where it would be taken for what the flight began with.
    TelemetryRow<ParamsRecord>{{channel::kParams, "params_t", kJobPublish, SentWhen::kOnCommand, /*published=*/true,
                                /*logged=*/false}},
    TelemetryRow<HealthRecord>{{channel::kNavHealth, "nav_health_t", kJobHealth, SentWhen::kEachRun}},
    TelemetryRow<ScheduleRecord>{{channel::kSchedule, "schedule_t", kJobHealth, SentWhen::kEachRun}},
    TelemetryRow<NavStateRecord>{{channel::kNavState, "nav_state_t", kJobNav, SentWhen::kEachImage}},
    TelemetryRow<TimingRecord>{{channel::kTiming, "timing_t", kJobNav, SentWhen::kEachImage}}};

/// The row of a record. It does not compile for one that has none, or two.
template <class Record>
inline constexpr const TelemetryRow<Record>& kTelemetryRow = std::get<TelemetryRow<Record>>(kTelemetry);

/// Does something with every row, in their order.
template <class Visit>
constexpr void for_each_telemetry_row(Visit visit) {
  std::apply([&visit](const auto&... rows) { (visit(static_cast<const SentRecord&>(rows)), ...); }, kTelemetry);
}

/// A row is sent at all, by a job that comes to do so, and has its channel for itself.
constexpr bool is_sound(const SentRecord& row) {
  const Job& job = kFlightSchedule[row.job];
  std::size_t on_channel = 0;
  for_each_telemetry_row(
      [&](const SentRecord& other) { on_channel += std::string_view(other.channel) == row.channel; });
  const bool in_time = row.when == SentWhen::kEachRun || row.when == SentWhen::kEachImage || job.period_ticks == 1;
  const bool of_images = job.thread == Thread::kOwn;  // the job that takes images is the one beside the ticks
  return (row.published || row.logged) && in_time && of_images == (row.when == SentWhen::kEachImage) && on_channel == 1;
}
static_assert(std::apply([](const auto&... rows) { return (is_sound(rows) && ...); }, kTelemetry));

}  // namespace plumb
