#include "drivers/can_range/dronecan.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

namespace plumb::can_range {
namespace {

// CRC-16/CCITT-FALSE.
constexpr std::uint16_t crc16(std::uint16_t crc, std::uint8_t byte) {
  constexpr unsigned kPolynomial = 0x1021;
  unsigned value = crc ^ static_cast<unsigned>(byte << 8U);
  for (int bit = 0; bit < 8; ++bit) value = value << 1U ^ ((value & 0x8000U) != 0 ? kPolynomial : 0U);
  return static_cast<std::uint16_t>(value);
}

// A transfer's checksum begins with the signature of its type, low byte first.
constexpr std::uint16_t crc_of_signature(std::uint64_t signature) {
  std::uint16_t crc = 0xFFFF;
  for (unsigned i = 0; i < 8; ++i) crc = crc16(crc, static_cast<std::uint8_t>(signature >> (8 * i)));
  return crc;
}
constexpr std::uint64_t kMeasurementSignature = 0x68FF'FE70'FC77'1952;
constexpr std::uint16_t kCrcSeed = crc_of_signature(kMeasurementSignature);
static_assert(kCrcSeed == 0x049C);

// What is told of a frame that is wrong: its identifier, and in the lowest 8 bits its tail or its size.
std::int64_t head_and_tail(const CanFrame& frame) { return std::int64_t{frame.id} << 8U | frame.data().back(); }
std::int64_t head_and_size(const CanFrame& frame) { return std::int64_t{frame.id} << 8U | frame.size; }

std::uint16_t little_endian(std::uint8_t low, std::uint8_t high) {
  return static_cast<std::uint16_t>(low | high << 8U);
}

// Five bits of two's complement that end `shift` bits above the lowest.
std::int8_t five_bits(unsigned bits, unsigned shift) {
  const auto value = static_cast<int>(bits >> shift & 0x1FU);
  return static_cast<std::int8_t>(value < 16 ? value : value - 32);
}

}  // namespace

double half_to_double(std::uint16_t half) {
  const bool negative = (half & 0x8000U) != 0;
  const int exponent = half >> 10U & 0x1F;
  const int fraction = half & 0x3FF;
  double magnitude = 0.0;
  if (exponent == 0x1F) {
    magnitude = fraction == 0 ? std::numeric_limits<double>::infinity() : std::numeric_limits<double>::quiet_NaN();
  } else if (exponent == 0) {
    magnitude = std::ldexp(fraction, -24);
  } else {
    magnitude = std::ldexp(0x400 + fraction, exponent - 25);
  }
  return negative ? -magnitude : magnitude;
}

MeasurementMessage decode_measurement(const std::array<std::uint8_t, kMeasurementBytes>& payload) {
  MeasurementMessage message;
  for (std::size_t i = 0; i < 7; ++i) message.timestamp_us |= static_cast<std::uint64_t>(payload[i]) << (8 * i);
  message.sensor_id = payload[7];
  // Bit fields are filled from the most significant bit: rrrrrppp ppyyyyyd.
  const auto beam = static_cast<unsigned>(payload[8] << 8U | payload[9]);
  message.roll_pitch_yaw = {five_bits(beam, 11), five_bits(beam, 6), five_bits(beam, 1)};
  message.has_orientation = (beam & 1U) != 0;
  message.field_of_view_rad = half_to_double(little_endian(payload[10], payload[11]));
  message.sensor_type = payload[12] >> 3U;
  message.reading_type = static_cast<ReadingType>(payload[12] & 0x7U);
  message.range_m = half_to_double(little_endian(payload[13], payload[14]));
  return message;
}

MeasurementTransfers::Node& MeasurementTransfers::node_of(std::uint8_t id) {
  Node* oldest = &nodes_[0];
  for (Node& node : nodes_) {
    if (node.id == id) return node;
    if (node.id == 0 ? oldest->id != 0 : (oldest->id != 0 && node.t_first < oldest->t_first)) oldest = &node;
  }
  if (oldest->id != 0) counters_.nodes_forgotten.add(oldest->id);
  *oldest = Node{};
  oldest->id = id;
  return *oldest;
}

void MeasurementTransfers::begin(Node& node, const ReceivedCanFrame& received) {
  if (node.active) counters_.abandoned.add(head_and_tail(received.frame));
  node.active = true;
  node.transfer_id = received.frame.data().back() & kTailTransferId;
  node.toggle = 0;
  node.size = 0;
  node.t_first = received.t;
}

Result<ReceivedMeasurement> MeasurementTransfers::on_frame(const ReceivedCanFrame& received) {
  const CanFrame& frame = received.frame;
  if (!frame.is_extended || (frame.id & kTypeAndServiceMask) != kMeasurementTypeId << kTypeIdShift)
    return Status::kNotReady;
  const auto source = static_cast<std::uint8_t>(frame.id & kMaxNodeId);
  // The message takes several frames, which an anonymous node may not send, and a tail alone says nothing.
  if (source == 0 || frame.size < 2 || frame.size > kCanMaxDataBytes) {
    counters_.malformed.add(head_and_size(frame));
    return Status::kNotReady;
  }
  const std::size_t size = frame.size - std::size_t{1};
  const std::uint8_t tail = frame.bytes[size];
  const std::uint8_t transfer_id = tail & kTailTransferId;
  const bool last = (tail & kTailEnd) != 0;
  Node& node = node_of(source);
  if ((tail & kTailStart) != 0) begin(node, received);
  if (!node.active) {
    counters_.orphans.add(head_and_tail(frame));
    return Status::kNotReady;
  }
  if (transfer_id != node.transfer_id || received.t - node.t_first > kMaxTransfer) {
    node.active = false;
    counters_.abandoned.add(head_and_tail(frame));
    return Status::kNotReady;
  }
  // A frame that comes twice has the toggle of the one before; the transfer goes on with the one that is due.
  if ((tail & kTailToggle) != node.toggle) {
    counters_.wrong_toggle.add(head_and_tail(frame));
    return Status::kNotReady;
  }
  const bool full = frame.size == kCanMaxDataBytes;
  if ((!last && !full) || size > node.bytes.size() - node.size) {
    node.active = false;
    counters_.malformed.add(head_and_size(frame));
    return Status::kNotReady;
  }
  std::copy_n(frame.bytes.begin(), size, node.bytes.begin() + static_cast<std::ptrdiff_t>(node.size));
  node.size += size;
  node.toggle ^= kTailToggle;
  return last ? finish(node, received) : Result<ReceivedMeasurement>(Status::kNotReady);
}

Result<ReceivedMeasurement> MeasurementTransfers::finish(Node& node, const ReceivedCanFrame& received) {
  node.active = false;
  if (node.size != node.bytes.size()) {
    counters_.malformed.add(head_and_size(received.frame));
    return Status::kNotReady;
  }
  std::array<std::uint8_t, kMeasurementBytes> payload{};
  std::copy_n(node.bytes.begin() + kCrcBytes, kMeasurementBytes, payload.begin());
  std::uint16_t crc = kCrcSeed;
  for (const std::uint8_t byte : payload) crc = crc16(crc, byte);
  const std::uint16_t crc_told = little_endian(node.bytes[0], node.bytes[1]);
  if (crc != crc_told) {
    counters_.crc_errors.add(std::int64_t{crc_told} << 16U | crc);
    return Status::kNotReady;
  }
  const Duration since = received.t - node.t_complete;
  const bool again = node.complete_id == node.transfer_id && since < kMaxTransfer;
  const unsigned missing = (node.transfer_id - node.complete_id - 1U) & kTailTransferId;
  if (!again && since < kMaxCounted && missing > 0) counters_.missing.add(missing, missing);
  node.complete_id = node.transfer_id;
  node.t_complete = received.t;
  if (again) {
    counters_.duplicates.add(head_and_tail(received.frame));
    return Status::kNotReady;
  }
  ++counters_.transfers;
  return ReceivedMeasurement{.t_first_frame = node.t_first, .node_id = node.id, .message = decode_measurement(payload)};
}

}  // namespace plumb::can_range
