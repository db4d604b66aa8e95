#pragma once
// What the drivers count as wrong, device by device, and what the log lost; and how their threads report it to the
// tick, which tells it as EventId::kDeviceFault.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "fsw/base/fault_counter.h"
#include "fsw/base/spsc_ring.h"
#include "fsw/base/throttle.h"

namespace plumb {

/// Numbers stay for good, as those of the counters below: a log is read by software of another year.
enum class FaultyDevice : std::uint8_t { kStim300 = 0, kCamera, kLidarLite, kCanRange, kLog };
inline constexpr std::array<std::string_view, 5> kFaultyDeviceNames{"STIM300", "camera", "LIDAR-Lite",
                                                                    "CAN range finder", "log"};

/// How a value is to be read.
enum class FaultValue : std::uint8_t {
  kNone = 0,  ///< there is nothing to tell
  kNumber,
  kBits,
  kPair,         ///< two numbers of 32 bits, the first in the upper ones
  kSystemError,  ///< errno, of Linux on the flight computer
};

/// A counter's name, and what the value is that comes with it. What it counts, and what its value means, is said in the
/// comment above it alone, from where tools/interface takes it: flight needs no prose.
struct FaultRow {
  std::string_view name;
  FaultValue value = FaultValue::kNone;
};

inline constexpr std::array<FaultRow, 18> kStim300Faults{{
    /// datagrams that began where they should and failed; value: checksum that came and the right one, 32 bits each
    {"checksum_errors", FaultValue::kBits},
    /// bytes that belonged to no datagram; value: the byte
    {"skipped_bytes", FaultValue::kBits},
    /// datagrams whose counter did not move; value: the unit's counter
    {"duplicates", FaultValue::kNumber},
    /// datagrams of a unit that did not tell its setting, or another than expected; value: settings that are not as
    /// expected; 0: not told, or not understood
    {"unconfigured", FaultValue::kNumber},
    /// datagrams of a unit that starts; value: status of gyros and accelerometers, 8 bits each
    {"starting", FaultValue::kBits},
    /// datagrams in which the unit reports an error of its sensors, or has no accelerometer; value: status of gyros and
    /// accelerometers, 8 bits each
    {"faulty", FaultValue::kBits},
    /// datagrams with the same numbers again and again; value: the X gyro [counts]
    {"stuck", FaultValue::kNumber},
    /// datagrams with an axis beyond its range, or soon after some; value: status of gyros and accelerometers, 8 bits
    /// each
    {"overloads", FaultValue::kBits},
    /// datagrams after a gap from which no sample could be made; value: the unit's counter
    {"unaligned", FaultValue::kNumber},
    /// datagrams stamped at or before the last sample; value: by how much [ns]
    {"out_of_order", FaultValue::kNumber},
    /// samples made outside operating conditions; value: status of gyros and accelerometers, 8 bits each
    {"conditions", FaultValue::kBits},
    /// datagrams that never came, by the unit's counter; value: step of the unit's counter, 2000 a second
    {"missing", FaultValue::kNumber},
    /// steps of the unit's counter that are no whole number of datagrams; value: step of the unit's counter, 2000 a
    /// second
    {"slips", FaultValue::kNumber},
    /// the unit was switched on or reset
    {"restarts"},
    /// stamps of the host and counter of the unit did not go together
    {"clock_corrections"},
    /// samples for which the ring to the tick had no room
    {"overflows"},
    /// returns of the serial line after it was gone
    {"reopened"},
    /// times that the serial line went away, or was still away for another reason than before; value: the system's
    /// reason (errno)
    {"gone", FaultValue::kSystemError},
}};

inline constexpr std::array<FaultRow, 11> kCameraFaults{{
    /// images that the source says are not whole; value: sequence of the source
    {"damaged", FaultValue::kNumber},
    /// buffers or messages that are no image as agreed on; value: width and height [px] that it tells, 32 bits each; 0
    /// and its bytes where it tells none
    {"malformed", FaultValue::kPair},
    /// images of another size than the calibration's; value: width and height [px], 32 bits each
    {"wrong_size", FaultValue::kPair},
    /// images equal to the one before; value: sequence of the source
    {"repeated", FaultValue::kNumber},
    /// images that did not come, by sequence or time; value: how many the last time
    {"lost", FaultValue::kNumber},
    /// images stamped or numbered at or before the one before; value: sequence of the source
    {"out_of_order", FaultValue::kNumber},
    /// stamps by another clock, in the future or too old; value: age that the stamp told [ns]
    {"stamps_mended", FaultValue::kNumber},
    /// returns after the camera was gone
    {"restarts"},
    /// changes of exposure that the camera did not take, and returns without the one that was set; value: the system's
    /// reason (errno)
    {"exposures_refused", FaultValue::kSystemError},
    /// images for which the store had no room; value: sequence of the source
    {"no_slot", FaultValue::kNumber},
    /// times that the camera went away, or was still away for another reason than before; value: the system's reason
    /// (errno)
    {"gone", FaultValue::kSystemError},
}};

inline constexpr std::array<FaultRow, 10> kLidarLiteFaults{{
    /// distances with the top bit set; value: distance registers
    {"not_ready", FaultValue::kBits},
    /// transfers that failed; value: the system's reason (errno)
    {"not_acknowledged", FaultValue::kSystemError},
    /// acquisitions that took too long; value: status register
    {"busy_timeouts", FaultValue::kBits},
    /// runs of distances that were zero or not ready; value: distance registers
    {"stuck", FaultValue::kBits},
    /// another model at the address; value: identity register
    {"wrong_model", FaultValue::kBits},
    /// presets that did not read back; value: register that did not read back
    {"verify_failures", FaultValue::kBits},
    /// resets of the device, that at the start included
    {"resets"},
    /// periods left out because an acquisition took longer than one; value: by how much [ns]
    {"late", FaultValue::kNumber},
    /// ranges for which the ring to the tick had no room
    {"overflows"},
    /// times that the adapter of the bus went away, or was still away for another reason than before; value: the
    /// system's reason (errno)
    {"gone", FaultValue::kSystemError},
}};

inline constexpr std::array<FaultRow, 17> kCanRangeFaults{{
    /// on a bus of Benewake's frames those of another size, on a DroneCAN bus ranges that are no positive number and
    /// readings of no known type; value: size of the frame [bytes] on the first; the range [m] as a double, or 256 and
    /// the type, on the second
    {"malformed", FaultValue::kBits},
    /// DroneCAN frames that no measurement has; value: identifier, and its size [bytes] in the lowest 8 bits
    {"malformed_transfers", FaultValue::kBits},
    /// transfers with a wrong checksum; value: checksum that came and the right one, 16 bits each
    {"crc_errors", FaultValue::kBits},
    /// frames out of turn; value: identifier, and the tail in the lowest 8 bits
    {"wrong_toggle", FaultValue::kBits},
    /// frames of transfers whose first frame was not seen; value: identifier, and the tail in the lowest 8 bits
    {"orphans", FaultValue::kBits},
    /// transfers begun and never finished; value: identifier, and the tail in the lowest 8 bits
    {"abandoned", FaultValue::kBits},
    /// transfers that had been received already; value: identifier, and the tail in the lowest 8 bits
    {"duplicates", FaultValue::kBits},
    /// nodes for which there was no room; value: the node
    {"nodes_forgotten", FaultValue::kNumber},
    /// what the controller reported, changes of its state included; value: class (linux/can/error.h), and its
    /// controller byte in the lowest 8 bits
    {"error_frames", FaultValue::kBits},
    /// ways off the bus
    {"bus_offs"},
    /// returns to it
    {"restarts"},
    /// frames that nobody took from the system in time
    {"lost_frames"},
    /// stamps that no frame can have; value: age that the stamp told [ns]
    {"stamps_mended", FaultValue::kNumber},
    /// statuses of Plumb's own that the bus did not take; value: the system's reason (errno)
    {"status_not_sent", FaultValue::kSystemError},
    /// ranges for which the ring to the tick had no room
    {"overflows"},
    /// transfers of which no sound one came, by their ids; value: how many the last time
    {"missing", FaultValue::kNumber},
    /// times that the interface went away, or was still away for another reason than before; value: the system's reason
    /// (errno)
    {"gone", FaultValue::kSystemError},
}};

inline constexpr std::array<FaultRow, 2> kLogFaults{{
    /// records that the queue of their thread had no room for
    {"no_room"},
    /// records that the file did not take; the first of them ends it; value: the system's reason (errno)
    {"not_written", FaultValue::kSystemError},
}};

/// The counters of each device, by its number.
inline constexpr std::array<std::span<const FaultRow>, kFaultyDeviceNames.size()> kDeviceFaultTables{
    kStim300Faults, kCameraFaults, kLidarLiteFaults, kCanRangeFaults, kLogFaults};

/// A counter that rose, and the newest of the values that it stands for.
struct DeviceFault {
  FaultyDevice device = FaultyDevice::kStim300;
  std::uint8_t counter = 0;  ///< number in the device's table above
  FaultCounter count;
};

using DeviceFaultRing = SpscRing<DeviceFault, 32>;

/// Reports the counters of a device from its thread, when one has risen and at most once a second.
template <std::size_t N>
class DeviceFaultReport {
 public:
  using Counts = std::array<FaultCounter, N>;
  static_assert(N <= DeviceFaultRing::capacity(), "all counters of a device fit into its ring at once");
  static constexpr Duration kPeriod = Duration::from_ms(1000);

  /// `ring` must outlive the report, which is its only producer.
  DeviceFaultReport(FaultyDevice device, DeviceFaultRing& ring) : device_(device), ring_(ring) {}

  /// The counters at `now`. What the ring has no room for is reported the next time.
  void look(Time now, const Counts& counts) {
    const auto has_risen = [&](std::size_t i) { return counts[i].count != reported_[i]; };
    bool any = false;
    for (std::size_t i = 0; i < N; ++i) any = any || has_risen(i);
    if (!any || !throttle_.admit(now)) return;
    for (std::size_t i = 0; i < N; ++i) {
      if (!has_risen(i)) continue;
      const DeviceFault fault{.device = device_, .counter = static_cast<std::uint8_t>(i), .count = counts[i]};
      if (ok(ring_.push(fault))) reported_[i] = counts[i].count;
    }
  }

 private:
  FaultyDevice device_;
  DeviceFaultRing& ring_;
  Throttle throttle_{1, kPeriod};
  std::array<std::uint64_t, N> reported_{};
};

}  // namespace plumb
