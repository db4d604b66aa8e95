#pragma once
// Datagrams of the Sensonor STIM300 in Normal mode: what each identifier stands for, and the numbers in it.
// Source: data sheet TS1524 rev.31, section 5.5; older units, which have an AUX input in place of PPS, after their
// drivers. Multi-byte fields are big-endian, signed ones two's complement.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "fsw/base/status.h"

namespace plumb::stim300 {

/// Numbers that share a status byte, in the order in which they stand in a datagram.
enum class ClusterId : std::uint8_t {
  kGyro = 0,
  kAccel,
  kInclinometer,
  kGyroTemperature,
  kAccelTemperature,
  kInclinometerTemperature,
  kPps,  ///< or AUX in older units: one number
};
inline constexpr std::size_t kClusterCount = 7;

enum class Kind : std::uint8_t {
  kUnknown = 0,  ///< no identifier
  kNormal,
  kPartNumber,
  kSerialNumber,
  kConfiguration,
  kBiasTrim,
  kErrorInfo,
};

/// What an identifier stands for.
struct Layout {
  Kind kind = Kind::kUnknown;
  std::uint8_t clusters = 0;  ///< of a normal datagram: bit i is set for ClusterId i
  std::uint8_t size = 0;      ///< bytes, checksum included, without CR LF

  constexpr bool has(ClusterId id) const { return (clusters >> static_cast<unsigned>(id) & 1U) != 0; }
};

inline constexpr std::size_t kChecksumBytes = 4;
inline constexpr std::size_t kMinDatagramBytes = 18;
inline constexpr std::size_t kMaxDatagramBytes = 63;

const Layout& layout_of(std::uint8_t identifier);

/// CRC-32/MPEG-2 (section 5.5.7) over the bytes and as many zeros as fill the last 32-bit word.
std::uint32_t checksum(std::span<const std::uint8_t> bytes);
/// The checksum that a datagram ends with. Precondition: more than four bytes.
std::uint32_t checksum_told(std::span<const std::uint8_t> datagram);
/// Whether the last four bytes are the checksum of those before. Precondition: more than four bytes.
bool checksum_holds(std::span<const std::uint8_t> datagram);
/// Whether the bytes are one datagram of this kind, of the right size and with a checksum that holds.
bool is_whole(std::span<const std::uint8_t> bytes, Kind kind);

/// Status byte (table 5-23).
inline constexpr std::uint8_t kStatusIntegrity = 0x80;  ///< system integrity error
inline constexpr std::uint8_t kStatusStarting = 0x40;   ///< not valid yet; the other bits mean nothing
inline constexpr std::uint8_t kStatusCondition = 0x20;  ///< outside operating conditions
inline constexpr std::uint8_t kStatusOverload = 0x10;   ///< of the axes in bits 2 (Z), 1 (Y) and 0 (X)
inline constexpr std::uint8_t kStatusChannel = 0x08;    ///< error in the measurement channel of those axes

struct Cluster {
  std::array<std::int32_t, 3> raw{};  ///< X, Y, Z in counts; PPS has the first only
  std::uint8_t status = 0;
  friend bool operator==(const Cluster&, const Cluster&) = default;
};

/// A normal datagram.
struct Datagram {
  Layout layout;
  std::array<Cluster, kClusterCount> clusters{};
  std::uint8_t counter = 0;      ///< of internal samples, 2000 a second, modulo 256
  std::uint16_t latency_us = 0;  ///< from the sample to the start of its transmission

  const Cluster& operator[](ClusterId id) const { return clusters[static_cast<std::size_t>(id)]; }
};

/// kInvalidValue: not a normal datagram of the right size, or its checksum is wrong.
Result<Datagram> decode(std::span<const std::uint8_t> bytes);

/// As printed on the unit: 'N' and 14 decimal digits.
using SerialNumber = std::array<char, 15>;
/// kInvalidValue: not a serial number datagram, or its checksum is wrong.
Result<SerialNumber> decode_serial_number(std::span<const std::uint8_t> bytes);

}  // namespace plumb::stim300
