#pragma once
// Datagrams of the STIM300 as the unit composes them, written from the data sheet (TS1524 rev.31, section 5.5) and
// apart from the driver: it shares no table and no code with what it tests.

#include <array>
#include <cstdint>
#include <vector>

namespace plumb::emulator {

using Bytes = std::vector<std::uint8_t>;
using Counts = std::array<std::int32_t, 3>;

struct Stim300Setup {
  int rate_code = 1;  ///< 125, 250, 500, 1000, 2000 datagrams a second
  bool accelerometer = true;
  bool inclinometer = false;
  bool temperatures = false;
  bool pps = false;
  bool aux = false;  ///< an older unit: PPS is AUX and has other identifiers
  bool cr_lf = false;
  int gyro_unit = 9;    ///< 0 rate, 1 angle increment, 2 average rate; 8 more: delayed
  int accel_unit = 1;   ///< 0 acceleration, 1 velocity increment, 2 average
  int gyro_filter = 4;  ///< 16, 33, 66, 131, 262 Hz
  int accel_filter = 4;
  int accel_range_g = 10;  ///< 5, 10, 30 or 80
  std::uint32_t baud = 921600;

  int rate_hz() const { return 125 << rate_code; }
  int internal_samples() const { return 16 >> rate_code; }  ///< to a datagram
};

/// What one datagram says; clusters that the setup leaves out are not used.
struct Stim300Content {
  Counts gyro{};
  Counts accel{};
  Counts inclinometer{};
  Counts temperature{};  ///< of every sensor
  std::int32_t pps = 0;
  std::uint8_t gyro_status = 0;
  std::uint8_t accel_status = 0;
  std::uint8_t other_status = 0;
  std::uint8_t counter = 0;
  std::uint16_t latency_us = 506;
};

Bytes encode_normal(const Stim300Setup& setup, const Stim300Content& content);
Bytes encode_configuration(const Stim300Setup& setup);
Bytes encode_part_number(const Stim300Setup& setup);
Bytes encode_serial_number(const Stim300Setup& setup);
/// Body with checksum, and CR LF where it is on.
Bytes with_checksum(Bytes body, bool cr_lf);
/// CRC-32/MPEG-2, bit by bit.
std::uint32_t crc32_mpeg2(const Bytes& bytes);

}  // namespace plumb::emulator
