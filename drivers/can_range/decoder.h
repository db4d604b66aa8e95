#pragma once
// Frames of a CAN range finder become samples: of DroneCAN nodes, or of a Benewake with a frame of its own.
//
// Sources: dronecan.h; Benewake TF03 manual V1.2.2 page 12 and TFmini-i-CAN manual (native frames).

#include <cstdint>

#include "drivers/can_range/dronecan.h"
#include "fsw/base/fault_counter.h"
#include "fsw/base/fixed_vector.h"
#include "fsw/measurement/samples.h"

namespace plumb::can_range {

enum class Protocol : std::uint8_t { kDronecan = 0, kBenewake };

inline constexpr int kAny = -1;
/// Tells a type in Counters::malformed from the size of a frame, and from the bits of a range of zero.
inline constexpr std::int64_t kMalformedReadingType = 256;

/// From 1 on no distance of a Benewake would be a return.
inline constexpr std::uint16_t kMinBenewakeFar_cm = 2;

struct Options {
  Protocol protocol = Protocol::kDronecan;
  int bus_bit_s = 1'000'000;          ///< 250000 for a TFmini-i as it comes
  Duration latency{};                 ///< from the middle of a measurement to the start of its first frame; 0 or more
  int node_id = kAny;                 ///< DroneCAN: the node listened to, 1 to 127, or kAny
  int sensor_id = kAny;               ///< DroneCAN: the sensor of that node, 0 to 255, or kAny
  std::uint32_t benewake_id = 0x003;  ///< standard identifier of the native frame
  std::uint16_t benewake_far_cm = 18'000;   ///< from this on the device means that there is no return
  std::uint16_t benewake_min_strength = 1;  ///< a weaker return is RangeQuality::kWeak
};

struct Counters {
  std::uint32_t ranges = 0;
  std::uint32_t no_returns = 0;  ///< too close and too far included
  std::uint32_t weak = 0;
  /// Native frames of another size, which is the value; ranges that are no positive number, whose value is their bits;
  /// DroneCAN readings of an undefined or unassigned type, whose value is kMalformedReadingType and the type.
  FaultCounter malformed;
  std::uint32_t other_sensors = 0;  ///< sound messages of sensors not listened to
};

/// A sample, and who sent it. Several sensors on one bus are told apart by these.
struct Reading {
  RangeSample sample;
  std::uint8_t node_id = 0;    ///< 0 for a native frame
  std::uint8_t sensor_id = 0;  ///< as above
};

class Decoder {
 public:
  /// Precondition: options within their limits.
  explicit Decoder(const Options& options);

  /// What to let through: the messages or the frame of the device and nothing else.
  CanFilter filter() const;
  /// The reading that this frame completes; kNotReady for any other frame, kRejected for one that was counted as bad.
  /// Stamped at the middle of the measurement: first frame's end, less its time on the bus, less the latency.
  Result<Reading> decode(const ReceivedCanFrame& received);

  const Counters& counters() const { return counters_; }
  const TransferCounters& transfer_counters() const { return transfers_.counters(); }

 private:
  Result<Reading> decode_dronecan(const ReceivedCanFrame& received);
  Result<Reading> decode_benewake(const ReceivedCanFrame& received);
  Time measured_at(Time t_frame_end, int frame_bits) const;
  void count(RangeQuality quality);

  Options options_;
  MeasurementTransfers transfers_;
  Counters counters_;
};

}  // namespace plumb::can_range
