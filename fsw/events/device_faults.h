#pragma once
// What the drivers count as wrong, device by device, and what the log lost; and how their threads report it to the
// tick, which tells it as EventId::kDeviceFaults.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "fsw/base/spsc_ring.h"
#include "fsw/base/throttle.h"

namespace plumb {

/// Numbers stay for good, as those of the counters below: a log is read by software of another year.
enum class FaultyDevice : std::uint8_t { kStim300 = 0, kCamera, kLidarLite, kCanRange, kLog };
inline constexpr std::array<std::string_view, 5> kFaultyDeviceNames{"STIM300", "camera", "LIDAR-Lite",
                                                                    "CAN range finder", "log"};

/// A counter's name, and what it counts.
struct FaultText {
  std::string_view name;
  std::string_view meaning;
};

inline constexpr std::array<FaultText, 17> kStim300Faults{{
    {"checksum_errors", "datagrams that began where they should and failed"},
    {"skipped_bytes", "bytes that belonged to no datagram"},
    {"duplicates", "datagrams whose counter did not move"},
    {"unconfigured", "datagrams of a unit that did not tell its setting, or another than expected"},
    {"starting", "datagrams of a unit that starts"},
    {"faulty", "datagrams in which the unit reports an error of its sensors, or has no accelerometer"},
    {"stuck", "datagrams with the same numbers again and again"},
    {"overloads", "datagrams with an axis beyond its range, or soon after some"},
    {"unaligned", "datagrams after a gap from which no sample could be made"},
    {"out_of_order", "datagrams stamped at or before the last sample"},
    {"conditions", "samples made outside operating conditions"},
    {"missing", "datagrams that never came, by the unit's counter"},
    {"slips", "steps of the unit's counter that are no whole number of datagrams"},
    {"restarts", "the unit was switched on or reset"},
    {"clock_corrections", "stamps of the host and counter of the unit did not go together"},
    {"overflows", "samples for which the ring to the tick had no room"},
    {"reopened", "returns of the serial line after it was gone"},
}};

inline constexpr std::array<FaultText, 10> kCameraFaults{{
    {"damaged", "images that the source says are not whole"},
    {"malformed", "buffers or messages that are no image as agreed on"},
    {"wrong_size", "images of another size than the calibration's"},
    {"repeated", "images equal to the one before"},
    {"lost", "images that did not come, by sequence or time"},
    {"out_of_order", "images stamped or numbered at or before the one before"},
    {"stamps_mended", "stamps by another clock, in the future or too old"},
    {"restarts", "returns after the camera was gone"},
    {"exposures_refused", "changes of exposure that the camera did not take"},
    {"no_slot", "images for which the store had no room"},
}};

inline constexpr std::array<FaultText, 9> kLidarLiteFaults{{
    {"not_ready", "distances with the top bit set"},
    {"not_acknowledged", "transfers that failed"},
    {"busy_timeouts", "acquisitions that took too long"},
    {"stuck", "runs of distances that were zero or not ready"},
    {"wrong_model", "another model at the address"},
    {"verify_failures", "presets that did not read back"},
    {"resets", "resets of the device, that at the start included"},
    {"late", "periods left out because an acquisition took longer than one"},
    {"overflows", "ranges for which the ring to the tick had no room"},
}};

inline constexpr std::array<FaultText, 16> kCanRangeFaults{{
    {"malformed", "frames of another size, ranges that are no positive number"},
    {"malformed_transfers", "DroneCAN frames that no measurement has"},
    {"crc_errors", "transfers with a wrong checksum"},
    {"wrong_toggle", "frames out of turn"},
    {"orphans", "frames of transfers whose first frame was not seen"},
    {"abandoned", "transfers begun and never finished"},
    {"duplicates", "transfers that had been received already"},
    {"nodes_forgotten", "nodes for which there was no room"},
    {"error_frames", "what the controller reported, changes of its state included"},
    {"bus_offs", "ways off the bus"},
    {"restarts", "returns to it"},
    {"lost_frames", "frames that nobody took from the system in time"},
    {"stamps_mended", "stamps that no frame can have"},
    {"status_not_sent", "statuses of Plumb's own that the bus did not take"},
    {"overflows", "ranges for which the ring to the tick had no room"},
    {"missing", "transfers of which no sound one came, by their ids"},
}};

inline constexpr std::array<FaultText, 2> kLogFaults{{
    {"no_room", "records that the queue of their thread had no room for"},
    {"not_written", "records that the file did not take; the first of them ends it"},
}};

/// The counters of each device, by its number.
inline constexpr std::array<std::span<const FaultText>, kFaultyDeviceNames.size()> kDeviceFaultTables{
    kStim300Faults, kCameraFaults, kLidarLiteFaults, kCanRangeFaults, kLogFaults};

/// A counter that rose.
struct DeviceFault {
  FaultyDevice device = FaultyDevice::kStim300;
  std::uint8_t counter = 0;  ///< number in the device's table above
  std::uint64_t count = 0;
  std::uint64_t before = 0;  ///< when it was last reported; 0 at first
};

using DeviceFaultRing = SpscRing<DeviceFault, 32>;

/// Reports the counters of a device from its thread, when one has risen and at most once a second.
template <std::size_t N>
class DeviceFaultReport {
 public:
  using Counts = std::array<std::uint64_t, N>;
  static_assert(N <= DeviceFaultRing::capacity(), "all counters of a device fit into its ring at once");
  static constexpr Duration kPeriod = Duration::from_ms(1000);

  /// `ring` must outlive the report, which is its only producer.
  DeviceFaultReport(FaultyDevice device, DeviceFaultRing& ring) : device_(device), ring_(ring) {}

  /// The counters at `now`. What the ring has no room for is reported the next time.
  void look(Time now, const Counts& counts) {
    if (counts == reported_ || !throttle_.admit(now)) return;
    for (std::size_t i = 0; i < N; ++i) {
      if (counts[i] == reported_[i]) continue;
      const DeviceFault fault{
          .device = device_, .counter = static_cast<std::uint8_t>(i), .count = counts[i], .before = reported_[i]};
      if (ok(ring_.push(fault))) reported_[i] = counts[i];
    }
  }

 private:
  FaultyDevice device_;
  DeviceFaultRing& ring_;
  Throttle throttle_{1, kPeriod};
  Counts reported_{};
};

}  // namespace plumb
