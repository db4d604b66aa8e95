#pragma once
// Watches the flight tick by tick, and tells what changed: the mode, how each sensor does, resets of the filter,
// commands. Fed with what is in input frames and in results of the nav job alone, so that a replay is told the same.

#include <array>
#include <span>

#include "fsw/app/nav_result.h"
#include "fsw/app/parameter_change.h"
#include "fsw/events/event.h"
#include "fsw/measurement/input_frame.h"
#include "fsw/modes/mode_machine.h"
#include "fsw/modes/sensor_health.h"

namespace plumb {

using SensorsHealth = std::array<SensorHealth, kSensorNames.size()>;

class FlightMonitor {
 public:
  /// A mode, three sensors, a reset, the commands, and the parameters that they set.
  using Events = FixedVector<Event, 5 + 2 * kMaxCommandsPerFrame>;

  /// What the output made of the samples of a tick.
  struct Output {
    SensorTick imu;
    Time t_imu = Time::never();  ///< newest sample of use
    const NavState& state;       ///< now
    /// What the commands of the tick set.
    std::span<const ParameterChange> changes = {};
  };

  explicit FlightMonitor(const ModeOptions& options)
      : modes_(options),
        imu_(options, options.imu_timeout_s),
        camera_(options, options.image_timeout_s),
        range_(options, options.range_timeout_s) {}

  /// Other options from the next step on.
  void use(const ModeOptions& options) {
    modes_.use(options);
    imu_.use(options, options.imu_timeout_s);
    camera_.use(options, options.image_timeout_s);
    range_.use(options, options.range_timeout_s);
  }
  /// A result that is in force from here on. Each once.
  void take(const NavResult& result);
  /// A tick is over. Precondition: time does not go back.
  void step(const InputFrame& input, const Output& output);
  /// A tick that nothing is known of.
  void skip() { events_.clear(); }

  NavMode mode() const { return modes_.mode(); }
  SensorsHealth sensors() const { return {imu_.health(), camera_.health(), range_.health()}; }
  /// Of the newest tick.
  const Events& events() const { return events_; }

 private:
  void tell(Event event);
  void judge(Sensor sensor, SensorMonitor& monitor, Time t, const SensorTick& tick);

  ModeMachine modes_;
  SensorMonitor imu_;
  SensorMonitor camera_;
  SensorMonitor range_;
  SensorTick images_judged_;  ///< since the last tick
  SensorTick ranges_judged_;
  EstimatorCounters estimator_;  ///< of the newest result
  NavSystemCounters system_;
  std::uint64_t resets_told_ = 0;
  Events events_;
};

}  // namespace plumb
