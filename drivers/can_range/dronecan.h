#pragma once
// Range measurements of DroneCAN (UAVCAN v0) nodes: frames become transfers, transfers messages.
//
// Sources: DroneCAN specification, "CAN bus transport layer"; public_regulated_data_types b4653c7,
// uavcan/equipment/range_sensor/1050.Measurement.

#include <array>
#include <cstddef>
#include <cstdint>

#include "fsw/base/fault_counter.h"
#include "fsw/base/status.h"
#include "fsw/base/time.h"
#include "hal/include/can_socket.h"

namespace plumb::can_range {

inline constexpr std::uint32_t kMeasurementTypeId = 1050;
inline constexpr std::size_t kMeasurementBytes = 15;
inline constexpr std::uint8_t kMaxNodeId = 127;

// A message frame's identifier: priority (5 bits), type (16), service flag (1), source node (7).
inline constexpr unsigned kPriorityShift = 24;
inline constexpr unsigned kTypeIdShift = 8;
inline constexpr std::uint32_t kTypeAndServiceMask = 0xFFFF80;  ///< of an identifier: message type and service flag
// The last byte of a frame: start and end of the transfer, toggle, transfer id.
inline constexpr std::uint8_t kTailStart = 0x80;
inline constexpr std::uint8_t kTailEnd = 0x40;
inline constexpr std::uint8_t kTailToggle = 0x20;
inline constexpr std::uint8_t kTailTransferId = 0x1F;

/// uavcan.equipment.range_sensor.Measurement, field reading_type; 4 to 7 are not assigned.
enum class ReadingType : std::uint8_t { kUndefined = 0, kValid, kTooClose, kTooFar };

struct MeasurementMessage {
  std::uint64_t timestamp_us = 0;  ///< of the node's network time; 0: it does not know
  std::uint8_t sensor_id = 0;
  bool has_orientation = false;
  std::array<std::int8_t, 3> roll_pitch_yaw{};  ///< of the beam in the body, in steps of 15 degrees
  double field_of_view_rad = 0.0;
  std::uint8_t sensor_type = 0;  ///< 0 undefined, 1 sonar, 2 lidar, 3 radar
  ReadingType reading_type = ReadingType::kUndefined;
  double range_m = 0.0;  ///< of half precision; may be infinite or not a number
};

MeasurementMessage decode_measurement(const std::array<std::uint8_t, kMeasurementBytes>& payload);

/// IEEE 754 binary16.
double half_to_double(std::uint16_t half);

/// What values mean, kCanRangeFaults tells (fsw/events/device_faults.h).
struct TransferCounters {
  std::uint32_t transfers = 0;   ///< complete and sound
  FaultCounter crc_errors;       ///< transfers whose checksum is wrong
  FaultCounter malformed;        ///< frames that no Measurement has: size, tail, anonymous source
  FaultCounter wrong_toggle;     ///< frames out of turn: one was lost or doubled
  FaultCounter orphans;          ///< frames of transfers whose first frame was not seen
  FaultCounter abandoned;        ///< transfers begun and never finished
  FaultCounter duplicates;       ///< transfers that had been received already
  FaultCounter missing;          ///< transfers of which no sound one came, by the ids before and after
  FaultCounter nodes_forgotten;  ///< more nodes than there is room for
};

struct ReceivedMeasurement {
  Time t_first_frame;  ///< end of the transfer's first frame
  std::uint8_t node_id = 0;
  MeasurementMessage message;
};

/// Puts transfers of Measurement together, of several nodes at once. Only a transfer that is complete, in order and has
/// the right checksum gives a message; whatever else is counted and passed over, and the next first frame begins anew.
class MeasurementTransfers {
 public:
  static constexpr std::size_t kMaxNodes = 4;
  /// Frames of a transfer follow each other at once. The specification would wait 2 s, but by then a node at 25 Hz has
  /// used the same transfer id again, and halves of two transfers could meet.
  static constexpr Duration kMaxTransfer = Duration::from_ms(100);
  /// After a longer silence nobody knows how many transfers it held: at 100 Hz the 32 ids have gone round.
  static constexpr Duration kMaxCounted = Duration::from_ms(300);

  /// The message that this frame completes; kNotReady for any other frame, of other types too.
  Result<ReceivedMeasurement> on_frame(const ReceivedCanFrame& received);
  const TransferCounters& counters() const { return counters_; }

 private:
  static constexpr std::size_t kCrcBytes = 2;

  struct Node {
    std::uint8_t id = 0;  ///< 0: free
    bool active = false;  ///< a transfer is under way
    std::uint8_t transfer_id = 0;
    std::uint8_t toggle = 0;  ///< that the next frame must have
    std::size_t size = 0;
    std::array<std::uint8_t, kCrcBytes + kMeasurementBytes> bytes{};
    Time t_first;
    Time t_complete = Time::never();  ///< end of the last sound transfer
    std::uint8_t complete_id = 0;     ///< and its id
  };

  Node& node_of(std::uint8_t id);
  void begin(Node& node, const ReceivedCanFrame& received);
  Result<ReceivedMeasurement> finish(Node& node, const ReceivedCanFrame& received);

  std::array<Node, kMaxNodes> nodes_{};
  TransferCounters counters_;
};

}  // namespace plumb::can_range
