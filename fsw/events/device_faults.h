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

/// A counter's name, what it counts, and what the value is that comes with it.
struct FaultText {
  struct Value {
    FaultValue kind = FaultValue::kNone;
    std::string_view meaning;
  };
  std::string_view name;
  std::string_view meaning;
  Value value{};
};

inline constexpr FaultText::Value kStatusBytes{FaultValue::kBits, "status of gyros and accelerometers, 8 bits each"};
inline constexpr FaultText::Value kSequence{FaultValue::kNumber, "sequence of the source"};
inline constexpr FaultText::Value kFrameTail{FaultValue::kBits, "identifier, and the tail in the lowest 8 bits"};
inline constexpr FaultText::Value kUnitCounter{FaultValue::kNumber, "the unit's counter"};
inline constexpr FaultText::Value kUnitStep{FaultValue::kNumber, "step of the unit's counter, 2000 a second"};
inline constexpr FaultText::Value kHowMany{FaultValue::kNumber, "how many the last time"};
inline constexpr FaultText::Value kLateness{FaultValue::kNumber, "by how much [ns]"};
inline constexpr FaultText::Value kToldAge{FaultValue::kNumber, "age that the stamp told [ns]"};
inline constexpr FaultText::Value kSystemError{FaultValue::kSystemError, "the system's reason (errno)"};

inline constexpr std::array<FaultText, 18> kStim300Faults{{
    {"checksum_errors",
     "datagrams that began where they should and failed",
     {FaultValue::kBits, "checksum that came and the right one, 32 bits each"}},
    {"skipped_bytes", "bytes that belonged to no datagram", {FaultValue::kBits, "the byte"}},
    {"duplicates", "datagrams whose counter did not move", kUnitCounter},
    {"unconfigured",
     "datagrams of a unit that did not tell its setting, or another than expected",
     {FaultValue::kNumber, "settings that are not as expected; 0: not told, or not understood"}},
    {"starting", "datagrams of a unit that starts", kStatusBytes},
    {"faulty", "datagrams in which the unit reports an error of its sensors, or has no accelerometer", kStatusBytes},
    {"stuck", "datagrams with the same numbers again and again", {FaultValue::kNumber, "the X gyro [counts]"}},
    {"overloads", "datagrams with an axis beyond its range, or soon after some", kStatusBytes},
    {"unaligned", "datagrams after a gap from which no sample could be made", kUnitCounter},
    {"out_of_order", "datagrams stamped at or before the last sample", kLateness},
    {"conditions", "samples made outside operating conditions", kStatusBytes},
    {"missing", "datagrams that never came, by the unit's counter", kUnitStep},
    {"slips", "steps of the unit's counter that are no whole number of datagrams", kUnitStep},
    {"restarts", "the unit was switched on or reset"},
    {"clock_corrections", "stamps of the host and counter of the unit did not go together"},
    {"overflows", "samples for which the ring to the tick had no room"},
    {"reopened", "returns of the serial line after it was gone"},
    {"gone", "the serial line is not there, or for another reason than before", kSystemError},
}};

inline constexpr std::array<FaultText, 11> kCameraFaults{{
    {"damaged", "images that the source says are not whole", kSequence},
    {"malformed",
     "buffers or messages that are no image as agreed on",
     {FaultValue::kPair, "width and height [px] that it tells, 32 bits each; 0 and its bytes where it tells none"}},
    {"wrong_size",
     "images of another size than the calibration's",
     {FaultValue::kPair, "width and height [px], 32 bits each"}},
    {"repeated", "images equal to the one before", kSequence},
    {"lost", "images that did not come, by sequence or time", kHowMany},
    {"out_of_order", "images stamped or numbered at or before the one before", kSequence},
    {"stamps_mended", "stamps by another clock, in the future or too old", kToldAge},
    {"restarts", "returns after the camera was gone"},
    {"exposures_refused", "changes of exposure that the camera did not take", kSystemError},
    {"no_slot", "images for which the store had no room", kSequence},
    {"gone", "the camera is not there, or for another reason than before", kSystemError},
}};

inline constexpr std::array<FaultText, 9> kLidarLiteFaults{{
    {"not_ready", "distances with the top bit set", {FaultValue::kBits, "distance registers"}},
    {"not_acknowledged", "transfers that failed", kSystemError},
    {"busy_timeouts", "acquisitions that took too long", {FaultValue::kBits, "status register"}},
    {"stuck", "runs of distances that were zero or not ready", {FaultValue::kBits, "distance registers"}},
    {"wrong_model", "another model at the address", {FaultValue::kBits, "identity register"}},
    {"verify_failures", "presets that did not read back", {FaultValue::kBits, "register that did not read back"}},
    {"resets", "resets of the device, that at the start included"},
    {"late", "periods left out because an acquisition took longer than one", kLateness},
    {"overflows", "ranges for which the ring to the tick had no room"},
}};

inline constexpr std::array<FaultText, 17> kCanRangeFaults{{
    {"malformed",
     "frames of another size, ranges that are no positive number",
     {FaultValue::kBits, "size of the frame [bytes], or the range [m] as a double"}},
    {"malformed_transfers",
     "DroneCAN frames that no measurement has",
     {FaultValue::kBits, "identifier, and its size [bytes] in the lowest 8 bits"}},
    {"crc_errors",
     "transfers with a wrong checksum",
     {FaultValue::kBits, "checksum that came and the right one, 16 bits each"}},
    {"wrong_toggle", "frames out of turn", kFrameTail},
    {"orphans", "frames of transfers whose first frame was not seen", kFrameTail},
    {"abandoned", "transfers begun and never finished", kFrameTail},
    {"duplicates", "transfers that had been received already", kFrameTail},
    {"nodes_forgotten", "nodes for which there was no room", {FaultValue::kNumber, "the node"}},
    {"error_frames",
     "what the controller reported, changes of its state included",
     {FaultValue::kBits, "class (linux/can/error.h), and its controller byte in the lowest 8 bits"}},
    {"bus_offs", "ways off the bus"},
    {"restarts", "returns to it"},
    {"lost_frames", "frames that nobody took from the system in time"},
    {"stamps_mended", "stamps that no frame can have", kToldAge},
    {"status_not_sent", "statuses of Plumb's own that the bus did not take", kSystemError},
    {"overflows", "ranges for which the ring to the tick had no room"},
    {"missing", "transfers of which no sound one came, by their ids", kHowMany},
    {"gone", "the interface is not there, or for another reason than before", kSystemError},
}};

inline constexpr std::array<FaultText, 2> kLogFaults{{
    {"no_room", "records that the queue of their thread had no room for"},
    {"not_written", "records that the file did not take; the first of them ends it", kSystemError},
}};

/// The counters of each device, by its number.
inline constexpr std::array<std::span<const FaultText>, kFaultyDeviceNames.size()> kDeviceFaultTables{
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
