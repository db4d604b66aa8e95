#include "test/emulators/uvc_camera/uvc_descriptors.h"

namespace plumb::emulator::uvc {
namespace {

constexpr std::uint8_t kClassInterface = 0x24;  // CS_INTERFACE
constexpr std::uint8_t kVideo = 0x0E;           // class of interfaces
constexpr std::uint8_t kTerminal = 3;           // where the stream leaves the camera's function

/// The bytes, behind one that tells their number.
void add(Bytes& all, const Bytes& rest) {
  all.push_back(static_cast<std::uint8_t>(rest.size() + 1));
  all.insert(all.end(), rest.begin(), rest.end());
}

/// Sets the two bytes of a total length, once it is known.
void set_total(Bytes& bytes, std::size_t offset) {
  bytes.at(offset) = static_cast<std::uint8_t>(bytes.size() & 0xFFU);
  bytes.at(offset + 1) = static_cast<std::uint8_t>(bytes.size() >> 8U);
}

Bytes device() {
  Bytes all;
  // USB 2.0, class by interface association, packets of 64 bytes, an identifier that is free for tests, two strings.
  add(all, {1, 0x00, 0x02, 0xEF, 2, 1, 64, 0x09, 0x12, 0x01, 0x00, 0x00, 0x01, 1, 2, 0, 1});
  return all;
}

Bytes control_interface(const Abilities& abilities) {
  Bytes all;
  Bytes header = {kClassInterface, 1, 0x10, 0x01, 0, 0};
  put(header, kClock_hz, 4);
  header.insert(header.end(), {1, kStreamingInterface});
  add(all, header);
  // Controls: mode of the automatic exposure (bit 1) and exposure time (bit 3).
  const std::uint8_t controls = abilities.has_exposure ? 0x0A : 0x00;
  add(all, {kClassInterface, 2, kCameraTerminal, 0x01, 0x02, 0, 0, 0, 0, 0, 0, 0, 0, 3, controls, 0, 0});
  // Control: gain (bit 9).
  add(all, {kClassInterface, 5, kProcessingUnit, kCameraTerminal, 0, 0, 2, 0x00, 0x02, 0, 0});
  add(all, {kClassInterface, 3, kTerminal, 0x01, 0x01, 0, kProcessingUnit, 0});
  set_total(all, 5);
  return all;
}

void add_format(Bytes& all, std::uint8_t number, Pixels pixels, const std::vector<std::uint32_t>& periods) {
  const std::string_view fourcc = pixels == Pixels::kY10 ? "Y10 " : "Y800";
  Bytes described = {kClassInterface, 4, number, 1};
  described.insert(described.end(), fourcc.begin(), fourcc.end());
  described.insert(described.end(), {0x00, 0x00, 0x10, 0x00, 0x80, 0x00, 0x00, 0xAA, 0x00, 0x38, 0x9B, 0x71});
  described.insert(described.end(), {static_cast<std::uint8_t>(8 * bytes_per_pixel(pixels)), 1, 0, 0, 0, 0});
  add(all, described);

  const std::uint32_t bits_per_s = image_bytes(pixels) * 8 * 30;
  Bytes frame = {kClassInterface, 5, 1, 0};
  put(frame, kWidth, 2);
  put(frame, kHeight, 2);
  put(frame, bits_per_s, 4);
  put(frame, bits_per_s, 4);
  put(frame, image_bytes(pixels), 4);
  put(frame, periods.front(), 4);
  frame.push_back(static_cast<std::uint8_t>(periods.size()));
  for (const std::uint32_t period : periods) put(frame, period, 4);
  add(all, frame);
}

Bytes streaming_interface(const Abilities& abilities) {
  Bytes all;
  const auto formats = static_cast<std::uint8_t>(abilities.formats.size());
  Bytes header = {kClassInterface, 1, formats, 0, 0, kStreamEndpoint, 0, kTerminal, 0, 0, 0, 1};
  header.insert(header.end(), formats, 0);
  add(all, header);
  for (std::uint8_t i = 0; i < formats; ++i) add_format(all, i + 1, abilities.formats[i], abilities.periods_100ns);
  set_total(all, 4);
  return all;
}

Bytes configuration(const Abilities& abilities) {
  Bytes all;
  add(all, {2, 0, 0, 2, 1, 0, 0x80, 250});
  add(all, {11, kControlInterface, 2, kVideo, 3, 0, 0});  // the two interfaces are one function
  add(all, {4, kControlInterface, 0, 0, kVideo, 1, 0, 0});
  const Bytes control = control_interface(abilities);
  all.insert(all.end(), control.begin(), control.end());
  add(all, {4, kStreamingInterface, 0, 1, kVideo, 2, 0, 0});
  const Bytes streaming = streaming_interface(abilities);
  all.insert(all.end(), streaming.begin(), streaming.end());
  add(all, {5, kStreamEndpoint, 2, 0x00, 0x02, 0});  // bulk, packets of 512 bytes
  set_total(all, 2);
  return all;
}

Bytes text(std::uint8_t index) {
  Bytes rest = {3};
  if (index == 0) {
    put(rest, 0x0409, 2);  // in English
  } else {
    for (const char letter : index == 2 ? kProduct : std::string_view("Plumb"))
      put(rest, static_cast<std::uint8_t>(letter), 2);
  }
  Bytes all;
  add(all, rest);
  return all;
}

}  // namespace

void put(Bytes& bytes, std::uint32_t value, int size) {
  for (int i = 0; i < size; ++i) bytes.push_back(static_cast<std::uint8_t>(value >> (8 * i) & 0xFFU));
}

std::uint32_t get(std::span<const std::uint8_t> bytes, std::size_t offset, int size) {
  std::uint32_t value = 0;
  for (int i = size - 1; i >= 0; --i) value = value << 8U | bytes[offset + static_cast<std::size_t>(i)];
  return value;
}

Bytes descriptor(std::uint8_t type, std::uint8_t index, const Abilities& abilities) {
  switch (type) {
    case 1: return device();
    case 2: return configuration(abilities);
    case 3: return index <= 2 ? text(index) : Bytes{};
    default: return {};
  }
}

}  // namespace plumb::emulator::uvc
