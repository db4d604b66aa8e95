#include "drivers/stim300/datagram.h"

namespace plumb::stim300 {
namespace {

constexpr std::uint8_t bit(ClusterId id) { return static_cast<std::uint8_t>(1U << static_cast<unsigned>(id)); }
constexpr bool is_temperature(std::size_t cluster) {
  return cluster >= static_cast<std::size_t>(ClusterId::kGyroTemperature) &&
         cluster <= static_cast<std::size_t>(ClusterId::kInclinometerTemperature);
}
constexpr std::size_t numbers_of(std::size_t cluster) {
  return cluster == static_cast<std::size_t>(ClusterId::kPps) ? 1 : 3;
}
constexpr std::size_t bytes_per_number(std::size_t cluster) { return is_temperature(cluster) ? 2 : 3; }

// Identifier, clusters, status bytes, counter, latency and checksum (table 5-20).
constexpr std::size_t size_of(std::uint8_t clusters) {
  std::size_t size = 1 + 1 + 2 + kChecksumBytes;
  for (std::size_t i = 0; i < kClusterCount; ++i) {
    if ((clusters >> i & 1U) != 0) size += numbers_of(i) * bytes_per_number(i) + 1;
  }
  return size;
}

// The content code of section 5.5.6: accelerometer 1, inclinometer 2, temperatures of the inertial clusters sent 4.
constexpr std::uint8_t clusters_of(unsigned content) {
  unsigned inertial = bit(ClusterId::kGyro);
  if ((content & 1U) != 0) inertial |= bit(ClusterId::kAccel);
  if ((content & 2U) != 0) inertial |= bit(ClusterId::kInclinometer);
  constexpr unsigned kToTemperature = static_cast<unsigned>(ClusterId::kGyroTemperature);
  return static_cast<std::uint8_t>((content & 4U) != 0 ? inertial | inertial << kToTemperature : inertial);
}

using LayoutTable = std::array<Layout, 256>;

constexpr void set_normal(LayoutTable& table, unsigned identifier, std::uint8_t clusters) {
  table[identifier] = {Kind::kNormal, clusters, static_cast<std::uint8_t>(size_of(clusters))};
}

constexpr LayoutTable make_layouts() {
  LayoutTable table{};
  // Table 5-21. With PPS the identifiers are 0xF0 to 0xF7; with AUX, 8 more than without.
  constexpr std::array<std::uint8_t, 8> kWithoutPps = {0x90, 0x91, 0x92, 0x93, 0x94, 0xA5, 0xA6, 0xA7};
  for (unsigned content = 0; content < kWithoutPps.size(); ++content) {
    const std::uint8_t clusters = clusters_of(content);
    const auto with_pps = static_cast<std::uint8_t>(clusters | bit(ClusterId::kPps));
    set_normal(table, kWithoutPps[content], clusters);
    set_normal(table, kWithoutPps[content] + 8U, with_pps);
    set_normal(table, 0xF0U + content, with_pps);
  }
  // Units up to revision C tell the temperatures of the gyros only.
  set_normal(table, 0x97, static_cast<std::uint8_t>(clusters_of(3) | bit(ClusterId::kGyroTemperature)));
  // Sections 5.5.1 to 5.5.5; the second identifier says that CR LF follows.
  table[0xB1] = table[0xB3] = {Kind::kPartNumber, 0, 20};
  table[0xB5] = table[0xB7] = {Kind::kSerialNumber, 0, 20};
  table[0xBC] = table[0xBD] = {Kind::kConfiguration, 0, 26};
  table[0xD1] = table[0xD2] = {Kind::kBiasTrim, 0, 40};
  table[0xBE] = table[0xBF] = {Kind::kErrorInfo, 0, 21};
  return table;
}

constexpr LayoutTable kLayouts = make_layouts();
static_assert(kLayouts[0x90].size == kMinDatagramBytes && kLayouts[0xF7].size == kMaxDatagramBytes);

constexpr std::array<std::uint32_t, 256> make_crc_table() {
  constexpr std::uint32_t kPolynomial = 0x04C11DB7;
  std::array<std::uint32_t, 256> table{};
  for (std::uint32_t i = 0; i < table.size(); ++i) {
    std::uint32_t remainder = i << 24U;
    for (int k = 0; k < 8; ++k) remainder = remainder << 1U ^ ((remainder >> 31U) != 0 ? kPolynomial : 0U);
    table[i] = remainder;
  }
  return table;
}

constexpr std::array<std::uint32_t, 256> kCrcTable = make_crc_table();

constexpr std::uint32_t crc_step(std::uint32_t crc, std::uint8_t byte) {
  return crc << 8U ^ kCrcTable[(crc >> 24U ^ byte) & 0xFFU];
}

std::uint32_t unsigned_at(std::span<const std::uint8_t> bytes, std::size_t at, std::size_t count) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < count; ++i) value = value << 8U | bytes[at + i];
  return value;
}

std::int32_t signed_at(std::span<const std::uint8_t> bytes, std::size_t at, std::size_t count) {
  const unsigned unused = 32U - 8U * static_cast<unsigned>(count);
  // Shifted to the top, so that the arithmetic shift back fills in the sign.
  return static_cast<std::int32_t>(unsigned_at(bytes, at, count) << unused) >> unused;
}

}  // namespace

const Layout& layout_of(std::uint8_t identifier) { return kLayouts[identifier]; }

std::uint32_t checksum(std::span<const std::uint8_t> bytes) {
  std::uint32_t crc = 0xFFFFFFFF;
  for (const std::uint8_t byte : bytes) crc = crc_step(crc, byte);
  constexpr std::size_t kWord = 4;
  for (std::size_t i = bytes.size(); i % kWord != 0; ++i) crc = crc_step(crc, 0);
  return crc;
}

std::uint32_t checksum_told(std::span<const std::uint8_t> datagram) {
  PLUMB_ASSERT(datagram.size() > kChecksumBytes);
  return unsigned_at(datagram, datagram.size() - kChecksumBytes, kChecksumBytes);
}

bool checksum_holds(std::span<const std::uint8_t> datagram) {
  const std::uint32_t told = checksum_told(datagram);
  return checksum(datagram.first(datagram.size() - kChecksumBytes)) == told;
}

bool is_whole(std::span<const std::uint8_t> bytes, Kind kind) {
  if (bytes.empty()) return false;
  const Layout& layout = layout_of(bytes[0]);
  return layout.kind == kind && layout.size == bytes.size() && checksum_holds(bytes);
}

Result<Datagram> decode(std::span<const std::uint8_t> bytes) {
  if (!is_whole(bytes, Kind::kNormal)) return Status::kInvalidValue;
  Datagram datagram;
  datagram.layout = layout_of(bytes[0]);
  std::size_t at = 1;
  for (std::size_t i = 0; i < kClusterCount; ++i) {
    if (!datagram.layout.has(static_cast<ClusterId>(i))) continue;
    Cluster& cluster = datagram.clusters[i];
    const std::size_t width = bytes_per_number(i);
    for (std::size_t axis = 0; axis < numbers_of(i); ++axis, at += width) {
      cluster.raw[axis] = signed_at(bytes, at, width);
    }
    cluster.status = bytes[at++];
  }
  datagram.counter = bytes[at];
  datagram.latency_us = static_cast<std::uint16_t>(unsigned_at(bytes, at + 1, 2));
  PLUMB_ASSERT(at + 3 + kChecksumBytes == bytes.size());
  return datagram;
}

Result<SerialNumber> decode_serial_number(std::span<const std::uint8_t> bytes) {
  if (!is_whole(bytes, Kind::kSerialNumber)) return Status::kInvalidValue;
  constexpr std::size_t kDigitBytes = 7;  // two decimal digits each
  SerialNumber number{};
  number[0] = static_cast<char>(bytes[1]);
  for (std::size_t i = 0; i < kDigitBytes; ++i) {
    const std::uint8_t digits = bytes[2 + i];
    if (digits >> 4U > 9 || (digits & 0xFU) > 9) return Status::kInvalidValue;
    number[1 + 2 * i] = static_cast<char>('0' + (digits >> 4U));
    number[2 + 2 * i] = static_cast<char>('0' + (digits & 0xFU));
  }
  return number;
}

}  // namespace plumb::stim300
