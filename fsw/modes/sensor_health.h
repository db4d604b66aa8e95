#pragma once
// How a sensor does, by what came of it and what was made of that: a state machine over facts of logical time, as
// mode_machine.h. A device that says of itself that a measurement is bad does not get that far: its driver gives none,
// or one of a quality that counts as refused.

#include <array>
#include <cstdint>

#include "fsw/base/time.h"
#include "fsw/modes/options.h"
#include "fsw/modes/state_table.h"

namespace plumb {

enum class Sensor : std::uint8_t { kImu = 0, kCamera, kRange };
inline constexpr std::array<std::string_view, 3> kSensorNames{"IMU", "camera", "range finder"};

enum class SensorState : std::uint8_t {
  kSilent = 0,  ///< also before its first sample
  kRejected,    ///< it speaks, and nothing of it is of use
  kDegraded,
  kOk,
};

namespace sensor_condition {
inline constexpr ConditionSet kSilent = 1U << 0;
inline constexpr ConditionSet kManyRefused = 1U << 1;
inline constexpr ConditionSet kSomeRefused = 1U << 2;
inline constexpr ConditionSet kPoor = 1U << 3;
inline constexpr ConditionSet kUnproven = 1U << 4;
inline constexpr ConditionSet kAll = (1U << 5) - 1U;
}  // namespace sensor_condition

/// By bit.
inline constexpr std::array<ConditionText, 5> kSensorConditions{{
    {"silent", "no sample for `modes.imu_timeout`, `modes.image_timeout`, `modes.range_timeout`"},
    {"many refused", "`modes.rejected_after` in a row"},
    {"some refused", "`modes.degraded_after` in a row"},
    {"poor", "in its last second less than `modes.poor_rate` of its best rate, or `modes.poor_share` refused"},
    {"unproven", "not yet `modes.restored_after` accepted in a row since one was refused"},
}};

inline constexpr std::array<StateRow<SensorState>, 4> kSensorTable{{
    {.state = SensorState::kSilent,
     .name = "silent",
     .enter = {.all_of = sensor_condition::kSilent},
     .stay = {.all_of = sensor_condition::kSilent}},
    {.state = SensorState::kRejected,
     .name = "rejected",
     .enter = {.all_of = sensor_condition::kManyRefused, .none_of = sensor_condition::kSilent},
     .stay = {.any_of = sensor_condition::kManyRefused | sensor_condition::kUnproven,
              .none_of = sensor_condition::kSilent}},
    {.state = SensorState::kDegraded,
     .name = "degraded",
     .enter = {.any_of = sensor_condition::kSomeRefused | sensor_condition::kPoor,
               .none_of = sensor_condition::kSilent | sensor_condition::kManyRefused},
     .stay = {.any_of = sensor_condition::kSomeRefused | sensor_condition::kPoor | sensor_condition::kUnproven,
              .none_of = sensor_condition::kSilent | sensor_condition::kManyRefused}},
    {.state = SensorState::kOk,
     .name = "ok",
     .enter = {.none_of = sensor_condition::kSilent | sensor_condition::kManyRefused | sensor_condition::kSomeRefused |
                          sensor_condition::kPoor},
     .stay = {.none_of = sensor_condition::kSilent | sensor_condition::kManyRefused | sensor_condition::kSomeRefused |
                         sensor_condition::kPoor}},
}};
static_assert(is_sound(kSensorTable, sensor_condition::kAll));

struct SensorHealth {
  SensorState state = SensorState::kSilent;
  double rate_hz = 0.0;         ///< over its last whole second
  Time t_last = Time::never();  ///< of the tick that brought the newest sample
  std::uint32_t refused_in_a_row = 0;
  std::uint64_t samples = 0;  ///< since start-up
  std::uint64_t refused = 0;
};

/// What became known of a sensor in one tick. A sample may be told of before it is known what came of it.
struct SensorTick {
  std::uint32_t samples = 0;
  std::uint32_t accepted = 0;
  std::uint32_t refused = 0;
};

class SensorMonitor {
 public:
  SensorMonitor(const ModeOptions& options, double silence_s) : options_(options), silence_s_(silence_s) {}
  /// Other options from the next step on.
  void use(const ModeOptions& options, double silence_s) {
    options_ = options;
    silence_s_ = silence_s;
  }

  /// Precondition: time does not go back.
  SensorState step(Time t, const SensorTick& tick);

  const SensorHealth& health() const { return health_; }

 private:
  void end_second(Time t);
  ConditionSet conditions(Time t) const;

  ModeOptions options_;
  double silence_s_;
  SensorHealth health_;
  std::uint32_t accepted_in_a_row_ = 0;
  bool refused_ever_ = false;
  bool poor_ = false;
  double best_rate_hz_ = 0.0;
  Time t_second_ = Time::never();  ///< beginning of the second that is counted
  SensorTick second_;
};

}  // namespace plumb
