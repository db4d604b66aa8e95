#include "drivers/can_range/decoder.h"

#include <bit>
#include <cmath>

namespace plumb::can_range {
namespace {

// Bits of a data frame without data, with the pause after it; stuff bits, up to a fifth more, are not known.
constexpr int kStandardFrameBits = 47;
constexpr int kExtendedFrameBits = 67;
constexpr double kMetresPerCm = 0.01;

}  // namespace

Decoder::Decoder(const Options& options) : options_(options) {
  PLUMB_ASSERT(options.bus_bit_s > 0 && options.latency >= Duration());
  PLUMB_ASSERT(options.node_id == kAny || (options.node_id >= 1 && options.node_id <= kMaxNodeId));
  PLUMB_ASSERT(options.sensor_id >= kAny && options.sensor_id <= 255);
  PLUMB_ASSERT(options.benewake_id <= kCanStandardIdMask);
}

CanFilter Decoder::filter() const {
  if (options_.protocol == Protocol::kBenewake) {
    return {.id = options_.benewake_id, .mask = kCanStandardIdMask, .is_extended = false};
  }
  // Type and service flag; the node too when it is known; any priority.
  CanFilter filter{.id = kMeasurementTypeId << kTypeIdShift, .mask = kTypeAndServiceMask, .is_extended = true};
  if (options_.node_id != kAny) {
    filter.id |= static_cast<std::uint32_t>(options_.node_id);
    filter.mask |= kMaxNodeId;
  }
  return filter;
}

Result<Reading> Decoder::decode(const ReceivedCanFrame& received) {
  return options_.protocol == Protocol::kDronecan ? decode_dronecan(received) : decode_benewake(received);
}

Time Decoder::measured_at(Time t_frame_end, int frame_bits) const {
  return t_frame_end - Duration::from_ns(frame_bits * kNsPerSecond / options_.bus_bit_s) - options_.latency;
}

void Decoder::count(RangeQuality quality) {
  switch (quality) {
    case RangeQuality::kValid: ++counters_.ranges; break;
    case RangeQuality::kNoReturn: ++counters_.no_returns; break;
    case RangeQuality::kWeak: ++counters_.weak; break;
  }
}

Result<Reading> Decoder::decode_dronecan(const ReceivedCanFrame& received) {
  const Result<ReceivedMeasurement> measured = transfers_.on_frame(received);
  if (!measured) return measured.status();
  const MeasurementMessage& message = measured->message;
  const bool other = (options_.node_id != kAny && measured->node_id != options_.node_id) ||
                     (options_.sensor_id != kAny && message.sensor_id != options_.sensor_id);
  if (other) {
    ++counters_.other_sensors;
    return Status::kNotReady;
  }
  Reading reading{.sample = {}, .node_id = measured->node_id, .sensor_id = message.sensor_id};
  reading.sample.t = measured_at(measured->t_first_frame, kExtendedFrameBits + 8 * static_cast<int>(kCanMaxDataBytes));
  if (message.reading_type < ReadingType::kValid || message.reading_type > ReadingType::kTooFar) {
    counters_.malformed.add(kMalformedReadingType + static_cast<std::int64_t>(message.reading_type));
    return Status::kRejected;
  }
  if (message.reading_type == ReadingType::kValid) {
    if (!std::isfinite(message.range_m) || message.range_m <= 0.0) {
      counters_.malformed.add(std::bit_cast<std::int64_t>(message.range_m));
      return Status::kRejected;
    }
    reading.sample.range_m = message.range_m;
    reading.sample.quality = RangeQuality::kValid;
  }
  count(reading.sample.quality);
  return reading;
}

Result<Reading> Decoder::decode_benewake(const ReceivedCanFrame& received) {
  const CanFrame& frame = received.frame;
  if (frame.is_extended || frame.id != options_.benewake_id) return Status::kNotReady;
  // TF03: distance, strength, two reserved bytes. TFmini-i: distance, strength, four bytes of its own time.
  if (frame.size != 6 && frame.size != 8) {
    counters_.malformed.add(frame.size);
    return Status::kRejected;
  }
  const auto distance_cm = static_cast<std::uint16_t>(frame.bytes[0] | frame.bytes[1] << 8U);
  const auto strength = static_cast<std::uint16_t>(frame.bytes[2] | frame.bytes[3] << 8U);
  Reading reading;
  reading.sample.t = measured_at(received.t, kStandardFrameBits + 8 * frame.size);
  if (distance_cm != 0 && distance_cm < options_.benewake_far_cm) {
    reading.sample.range_m = distance_cm * kMetresPerCm;
    reading.sample.quality = strength >= options_.benewake_min_strength ? RangeQuality::kValid : RangeQuality::kWeak;
  }
  count(reading.sample.quality);
  return reading;
}

}  // namespace plumb::can_range
