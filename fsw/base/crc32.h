#pragma once
// CRC-32 as in IEEE 802.3: reflected, polynomial 0x04C11DB7, over everything inverted at both ends. What zlib and
// Python call crc32.

#include <cstdint>
#include <span>

namespace plumb {

/// `before`: the CRC of what comes before these bytes, as zlib's crc32() takes it.
constexpr std::uint32_t crc32(std::span<const std::uint8_t> bytes, std::uint32_t before = 0) {
  constexpr std::uint32_t kPolynomial = 0xEDB88320U;  // its bits in reverse
  std::uint32_t crc = ~before;
  for (const std::uint8_t byte : bytes) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1U) ^ ((crc & 1U) != 0 ? kPolynomial : 0U);
  }
  return ~crc;
}

}  // namespace plumb
