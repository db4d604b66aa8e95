#include "test/emulators/can_range/can_range_encoder.h"

#include <algorithm>
#include <cmath>

namespace plumb::test {
namespace {

/// Bits in the order of the bus: each byte from its most significant bit.
class BitStream {
 public:
  void put(std::uint64_t value, unsigned bits) {
    for (unsigned i = bits; i-- > 0;) bits_.push_back((value >> i & 1U) != 0);
  }
  /// Whole bytes, low byte first.
  void put_little_endian(std::uint64_t value, unsigned bytes) {
    for (unsigned i = 0; i < bytes; ++i) put(value >> (8 * i) & 0xFFU, 8);
  }
  std::vector<std::uint8_t> bytes() const {
    std::vector<std::uint8_t> packed((bits_.size() + 7) / 8);
    for (std::size_t i = 0; i < bits_.size(); ++i) {
      if (bits_[i]) packed[i / 8] = static_cast<std::uint8_t>(packed[i / 8] | 0x80U >> i % 8);
    }
    return packed;
  }

 private:
  std::vector<bool> bits_;
};

/// Polynomial division of the message, bit by bit, register starting at all ones.
std::uint16_t checksum(const std::vector<std::uint8_t>& bytes) {
  unsigned remainder = 0xFFFF;
  for (const std::uint8_t byte : bytes) {
    for (unsigned bit = 8; bit-- > 0;) {
      const unsigned out = (remainder >> 15U ^ byte >> bit) & 1U;
      remainder = remainder << 1U & 0xFFFFU;
      if (out != 0) remainder ^= 0x1021U;
    }
  }
  return static_cast<std::uint16_t>(remainder);
}

}  // namespace

std::uint16_t to_half(double value) {
  if (std::isnan(value)) return 0x7E00;
  if (std::isinf(value)) return 0x7C00;
  if (value == 0.0) return 0;
  int exponent = 0;
  const double fraction = std::frexp(value, &exponent);  // value = fraction * 2^exponent, fraction in [0.5, 1)
  const long units = std::lround(std::ldexp(fraction, 11));
  return static_cast<std::uint16_t>((exponent + 14) * 1024 + (units - 1024));
}

std::vector<CanFrame> measurement_frames(const DronecanSensor& sensor, double range_m, unsigned reading_type,
                                         unsigned transfer_id) {
  BitStream payload;
  payload.put_little_endian(sensor.timestamp_us, 7);
  payload.put(sensor.sensor_id, 8);
  payload.put(static_cast<unsigned>(sensor.roll) & 31U, 5);
  payload.put(static_cast<unsigned>(sensor.pitch) & 31U, 5);
  payload.put(static_cast<unsigned>(sensor.yaw) & 31U, 5);
  payload.put(sensor.has_orientation ? 1 : 0, 1);
  payload.put_little_endian(to_half(sensor.field_of_view_rad), 2);
  payload.put(sensor.sensor_type, 5);
  payload.put(reading_type, 3);
  payload.put_little_endian(to_half(range_m), 2);
  const std::vector<std::uint8_t> message = payload.bytes();

  BitStream checked;
  checked.put_little_endian(0x68FFFE70FC771952U, 8);
  std::vector<std::uint8_t> covered = checked.bytes();
  covered.insert(covered.end(), message.begin(), message.end());
  const std::uint16_t crc = checksum(covered);
  std::vector<std::uint8_t> transfer{static_cast<std::uint8_t>(crc & 0xFF), static_cast<std::uint8_t>(crc >> 8)};
  transfer.insert(transfer.end(), message.begin(), message.end());

  std::vector<CanFrame> frames;
  for (std::size_t begin = 0; begin < transfer.size(); begin += 7) {
    const std::size_t size = std::min<std::size_t>(7, transfer.size() - begin);
    CanFrame frame;
    frame.id = sensor.priority * 0x1000000U + 1050U * 0x100U + sensor.node_id;
    frame.is_extended = true;
    frame.size = static_cast<std::uint8_t>(size + 1);
    for (std::size_t i = 0; i < size; ++i) frame.bytes[i] = transfer[begin + i];
    const bool first = begin == 0;
    const bool last = begin + size == transfer.size();
    const bool toggle = frames.size() % 2 == 1;
    frame.bytes[size] =
        static_cast<std::uint8_t>((first ? 128 : 0) + (last ? 64 : 0) + (toggle ? 32 : 0) + transfer_id % 32);
    frames.push_back(frame);
  }
  return frames;
}

CanFrame benewake_frame(unsigned distance_cm, unsigned strength) {
  CanFrame frame{.id = 0x003, .is_extended = false, .size = 6, .bytes = {}};
  frame.bytes[0] = static_cast<std::uint8_t>(distance_cm % 256);
  frame.bytes[1] = static_cast<std::uint8_t>(distance_cm / 256);
  frame.bytes[2] = static_cast<std::uint8_t>(strength % 256);
  frame.bytes[3] = static_cast<std::uint8_t>(strength / 256);
  return frame;
}

CanFrame benewake_frame(unsigned distance_cm, unsigned strength, std::uint32_t time_ms) {
  CanFrame frame = benewake_frame(distance_cm, strength);
  frame.size = 8;
  for (unsigned i = 0; i < 4; ++i) frame.bytes[4 + i] = static_cast<std::uint8_t>(time_ms >> (8 * i));
  return frame;
}

}  // namespace plumb::test
