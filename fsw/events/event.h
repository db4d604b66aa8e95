#pragma once
// What happened, as a record of numbers. No text is sent or logged: docs/executive.md and the tools have what an id
// means, device_faults.h what a device counts.

#include <array>
#include <cstdint>

#include "fsw/base/time.h"

namespace plumb {

enum class EventSeverity : std::uint8_t {
  kInfo = 0,
  kWarning,  ///< a fault of the world that was survived
  kFailure,  ///< there is no navigation
};

/// Numbers stay for good: a log is read by software of another year. The four arguments of each, in their order.
enum class EventId : std::uint16_t {
  kJobOverrun = 1,         ///< job, time taken [ns], budget [ns], kept back
  kJobSlip = 2,            ///< job, time from start to start [ns], period [ns], kept back
  kResultLate = 3,         ///< tick, results late so far, 0, kept back
  kImageSkipped = 4,       ///< tick, sequence of the image, images skipped so far, kept back
  kNavMissed = 5,          ///< tick, frames missed so far, 0, kept back
  kParametersDamaged = 6,  ///< whose (0 tick, 1 nav), ParamDamage (fsw/params/param_store.h), 0, 0
  kDeviceFaults = 7,       ///< of earlier versions only: device, counter, its count so far, its count when last told
  kDeviceFault = 8,        ///< device, counter (fsw/events/device_faults.h), its count so far, last value (0: none)
  // From here on a function of the input frames, told at every occurrence: a replay tells the same.
  kModeChanged = 16,    ///< NavMode before and now, conditions that hold (fsw/modes/mode_machine.h), resets so far
  kSensorChanged = 17,  ///< Sensor, SensorState before and now, samples refused in a row
  kFilterReset = 18,    ///< resets, commanded ones among them, numerical faults, holes in the IMU's samples so far
  kCommand = 19,        ///< CommandId, source, sequence, CommandVerdict
  kParameterSet = 20,   ///< number of the parameter, bits of its value before and now (double), CRC of the table
};

struct Event {
  EventId id = EventId::kJobOverrun;
  EventSeverity severity = EventSeverity::kWarning;
  Time t;  ///< logical: end of the tick that saw it
  std::array<std::int64_t, 4> arguments{};
};

}  // namespace plumb
