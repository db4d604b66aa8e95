#include "test/emulators/stim300/stim300_encoder.h"

namespace plumb::emulator {
namespace {

void append(Bytes& bytes, std::int64_t value, int size) {
  for (int i = size - 1; i >= 0; --i) bytes.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}

void append(Bytes& bytes, const Counts& counts, int size, std::uint8_t status) {
  for (const std::int32_t count : counts) append(bytes, count, size);
  bytes.push_back(status);
}

std::uint8_t identifier(const Stim300Setup& setup) {
  const int content = (setup.accelerometer ? 1 : 0) + (setup.inclinometer ? 2 : 0) + (setup.temperatures ? 4 : 0);
  if (setup.pps && !setup.aux) return static_cast<std::uint8_t>(0xF0 + content);
  const int plain = content < 5 ? 0x90 + content : 0xA0 + content;
  return static_cast<std::uint8_t>(setup.pps ? plain + 8 : plain);
}

int range_code(int range_g) {
  switch (range_g) {
    case 5: return 3;
    case 30: return 4;
    case 80: return 6;
    default: return 0;
  }
}

}  // namespace

std::uint32_t crc32_mpeg2(const Bytes& bytes) {
  std::uint32_t crc = 0xFFFFFFFFU;
  for (const std::uint8_t byte : bytes) {
    for (int bit = 7; bit >= 0; --bit) {
      const bool one = ((crc >> 31U) ^ (byte >> bit & 1U)) != 0;
      crc <<= 1U;
      if (one) crc ^= 0x04C11DB7U;
    }
  }
  return crc;
}

Bytes with_checksum(Bytes body, bool cr_lf) {
  Bytes padded = body;
  while (padded.size() % 4 != 0) padded.push_back(0);
  append(body, crc32_mpeg2(padded), 4);
  if (cr_lf) body.insert(body.end(), {'\r', '\n'});
  return body;
}

Bytes encode_normal(const Stim300Setup& setup, const Stim300Content& content) {
  Bytes body = {identifier(setup)};
  append(body, content.gyro, 3, content.gyro_status);
  if (setup.accelerometer) append(body, content.accel, 3, content.accel_status);
  if (setup.inclinometer) append(body, content.inclinometer, 3, content.other_status);
  if (setup.temperatures) {
    const int sensors = 1 + (setup.accelerometer ? 1 : 0) + (setup.inclinometer ? 1 : 0);
    for (int i = 0; i < sensors; ++i) append(body, content.temperature, 2, content.other_status);
  }
  if (setup.pps) {
    append(body, content.pps, 3);
    body.push_back(content.other_status);
  }
  body.push_back(content.counter);
  append(body, content.latency_us, 2);
  return with_checksum(body, setup.cr_lf);
}

Bytes encode_configuration(const Stim300Setup& s) {
  const auto nibbles = [](int high, int low) { return static_cast<std::uint8_t>(high << 4 | low); };
  const int content =
      (s.pps ? 16 : 0) + (s.temperatures ? 8 : 0) + (s.inclinometer ? 4 : 0) + (s.accelerometer ? 2 : 0);
  int baud_code = 15;
  if (s.baud == 374400) baud_code = 0;
  if (s.baud == 460800) baud_code = 1;
  if (s.baud == 921600) baud_code = 2;
  if (s.baud == 1843200) baud_code = 3;
  const int range = range_code(s.accel_range_g);
  Bytes body = {static_cast<std::uint8_t>(s.cr_lf ? 0xBD : 0xBC),
                'K',
                0,
                static_cast<std::uint8_t>(s.rate_code << 5 | content | (s.cr_lf ? 1 : 0)),
                nibbles(baud_code, 1),
                nibbles(7, s.gyro_unit),
                nibbles(s.gyro_filter, s.gyro_filter),
                nibbles(s.gyro_filter, 0),
                nibbles(7, s.accel_unit),
                nibbles(s.accel_filter, s.accel_filter),
                nibbles(s.accel_filter, 0),
                0x70,
                0x44,
                0x42,
                static_cast<std::uint8_t>(s.aux ? 0x04 : 0x0C),
                0,
                0,
                nibbles(range, range),
                nibbles(range, 0),
                0,
                0,
                0};
  return with_checksum(body, s.cr_lf);
}

Bytes encode_part_number(const Stim300Setup& setup) {
  Bytes body = {static_cast<std::uint8_t>(setup.cr_lf ? 0xB3 : 0xB1), 0x08, 0x41, 0x67, '-'};
  body.resize(16);
  body.back() = 'K';
  return with_checksum(body, setup.cr_lf);
}

Bytes encode_serial_number(const Stim300Setup& setup) {
  Bytes body = {static_cast<std::uint8_t>(setup.cr_lf ? 0xB7 : 0xB5), 'N', 0x25, 0x58, 0x24, 0x05, 0x00, 0x20, 0x02};
  body.resize(16);
  return with_checksum(body, setup.cr_lf);
}

}  // namespace plumb::emulator
