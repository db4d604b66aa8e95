#include "fsw/app/flight_monitor.h"

#include <bit>

namespace plumb {
namespace {

std::uint32_t difference(std::uint64_t now, std::uint64_t before) { return static_cast<std::uint32_t>(now - before); }

std::int64_t argument(std::uint64_t value) { return static_cast<std::int64_t>(value); }

// The order in which the enum has them is that of the aiding, best first; without a state comes after any with one.
int rank(NavMode mode) {
  return mode == NavMode::kInitialising ? static_cast<int>(NavMode::kFailed) : static_cast<int>(mode);
}

EventSeverity severity_of(NavMode from, NavMode to) {
  if (to == NavMode::kFailed) return EventSeverity::kFailure;
  return rank(to) > rank(from) ? EventSeverity::kWarning : EventSeverity::kInfo;
}

}  // namespace

void FlightMonitor::take(const NavResult& result) {
  const FrameReport& report = result.report;
  if (result.state.valid) {
    const bool held = result.state.t_vision == result.state.t;
    ++(held ? images_judged_.accepted : images_judged_.refused);
  }
  images_judged_.refused += difference(result.system.frames_refused, system_.frames_refused);
  ranges_judged_.accepted += difference(result.estimator.ranges_used, estimator_.ranges_used) + report.ranged_used;
  ranges_judged_.refused += difference(result.estimator.ranges_gated, estimator_.ranges_gated) +
                            difference(result.estimator.ranges_invalid, estimator_.ranges_invalid) +
                            report.ranged_rejected;
  estimator_ = result.estimator;
  system_ = result.system;
}

void FlightMonitor::step(const InputFrame& input, const Output& output) {
  events_.clear();
  const Time t = input.t;
  for (const Command& command : input.commands) {
    const bool accepted = command.verdict == CommandVerdict::kAccepted;
    tell({.id = EventId::kCommand,
          .severity = accepted ? EventSeverity::kInfo : EventSeverity::kWarning,
          .t = t,
          .arguments = {command.id, command.source, command.sequence, static_cast<std::int64_t>(command.verdict)}});
  }
  for (const ParameterChange& change : output.changes) {
    tell({.id = EventId::kParameterSet,
          .severity = EventSeverity::kInfo,
          .t = t,
          .arguments = {argument(change.number), std::bit_cast<std::int64_t>(change.before),
                        std::bit_cast<std::int64_t>(change.after), parameter_table_crc()}});
  }
  if (estimator_.resets != resets_told_) {
    resets_told_ = estimator_.resets;
    tell({.id = EventId::kFilterReset,
          .t = t,
          .arguments = {argument(estimator_.resets), argument(system_.commanded_resets),
                        argument(estimator_.numerical_faults), argument(estimator_.imu_gaps)}});
  }
  const NavMode before = modes_.mode();
  const NavMode mode = modes_.step({.t = t,
                                    .has_state = output.state.valid,
                                    .t_imu = output.t_imu,
                                    .t_vision = output.state.t_vision,
                                    .t_range = output.state.t_range,
                                    .resets = estimator_.resets - system_.commanded_resets,
                                    .numerical_faults = estimator_.numerical_faults});
  if (mode != before) {
    tell({.id = EventId::kModeChanged,
          .severity = severity_of(before, mode),
          .t = t,
          .arguments = {static_cast<std::int64_t>(before), static_cast<std::int64_t>(mode), modes_.conditions(),
                        argument(estimator_.resets)}});
  }
  images_judged_.samples = input.has_camera ? 1 : 0;
  if (input.has_camera && input.image_skipped && input.camera.t_exposure_mid > t) ++images_judged_.refused;
  ranges_judged_.samples = static_cast<std::uint32_t>(input.range.size());
  judge(Sensor::kImu, imu_, t, output.imu);
  judge(Sensor::kCamera, camera_, t, images_judged_);
  judge(Sensor::kRange, range_, t, ranges_judged_);
  images_judged_ = {};
  ranges_judged_ = {};
}

void FlightMonitor::judge(Sensor sensor, SensorMonitor& monitor, Time t, const SensorTick& tick) {
  const SensorState before = monitor.health().state;
  const SensorState now = monitor.step(t, tick);
  if (now == before) return;
  tell({.id = EventId::kSensorChanged,
        .severity = now == SensorState::kOk ? EventSeverity::kInfo : EventSeverity::kWarning,
        .t = t,
        .arguments = {static_cast<std::int64_t>(sensor), static_cast<std::int64_t>(before),
                      static_cast<std::int64_t>(now), monitor.health().refused_in_a_row}});
}

void FlightMonitor::tell(Event event) {
  const Status told = events_.push_back(event);
  PLUMB_ASSERT(ok(told));  // there is room for everything that a tick can change
}

}  // namespace plumb
