#pragma once
// What the emulated USB camera says of itself.
// Source: Universal Serial Bus Specification 2.0, chapter 9; USB Device Class Definition for Video Devices 1.1 and its
// payload specification for uncompressed formats.

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace plumb::emulator::uvc {

using Bytes = std::vector<std::uint8_t>;

inline constexpr std::string_view kProduct = "Plumb grey camera";

inline constexpr int kWidth = 640;
inline constexpr int kHeight = 480;

enum class Pixels : std::uint8_t {
  kGrey = 0,  ///< 8 bits
  kY10,       ///< 10 bits in two bytes, low byte first
};

inline constexpr std::uint8_t kControlInterface = 0;
inline constexpr std::uint8_t kStreamingInterface = 1;
inline constexpr std::uint8_t kCameraTerminal = 1;
inline constexpr std::uint8_t kProcessingUnit = 2;
inline constexpr std::uint8_t kStreamEndpoint = 0x81;  ///< bulk, to the host
inline constexpr std::uint32_t kClock_hz = 10'000'000;

struct Abilities {
  std::vector<Pixels> formats = {Pixels::kGrey, Pixels::kY10};  ///< numbered from 1, as frame periods are
  bool has_exposure = true;
  std::vector<std::uint32_t> periods_100ns = {333'333};
};

constexpr std::uint32_t bytes_per_pixel(Pixels pixels) { return pixels == Pixels::kY10 ? 2 : 1; }
constexpr std::uint32_t image_bytes(Pixels pixels) { return kWidth * kHeight * bytes_per_pixel(pixels); }

/// USB's numbers have their low byte first.
void put(Bytes& bytes, std::uint32_t value, int size);
std::uint32_t get(std::span<const std::uint8_t> bytes, std::size_t offset, int size);

/// The descriptor of this type and index; empty: there is none.
Bytes descriptor(std::uint8_t type, std::uint8_t index, const Abilities& abilities);

}  // namespace plumb::emulator::uvc
