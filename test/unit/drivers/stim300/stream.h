#pragma once
// Streams of datagrams, damaged and not, and what the framer makes of them.

#include <fstream>
#include <iterator>
#include <optional>
#include <vector>

#include "drivers/stim300/framer.h"
#include "test/support/data.h"
#include "test/unit/drivers/stim300/vectors.h"

namespace plumb::test {

/// A datagram and where in the stream it was handed out: after how many bytes.
struct Found {
  Bytes bytes;
  std::size_t after = 0;
};

/// Everything the framer finds, `finish` telling that the stream ends.
inline std::vector<Found> find_datagrams(const Bytes& stream, stim300::Framer& framer, bool finish = true) {
  std::vector<Found> found;
  stim300::Frame frame;
  std::size_t pushed = 0;
  const auto take_out = [&] {
    while (framer.next(frame)) found.push_back({{frame.bytes.begin(), frame.bytes.end()}, pushed});
  };
  for (const std::uint8_t byte : stream) {
    ++pushed;
    framer.push(byte, Time::from_ns(static_cast<std::int64_t>(pushed)));
    take_out();
  }
  if (finish) framer.finish();
  take_out();
  return found;
}

inline std::vector<Found> find_datagrams(const Bytes& stream) {
  stim300::Framer framer;
  return find_datagrams(stream, framer);
}

/// 8392 datagrams of a real unit at 2000 Hz, each with CR LF, and 28 bytes of one cut off.
struct Capture {
  static constexpr std::size_t kDatagrams = 8392;
  static constexpr std::size_t kPitch = 40;
  static constexpr std::size_t kSize = 38;

  static std::optional<Bytes> read() {
    const auto folder = data_folder("stim300");
    if (!folder) return std::nullopt;
    std::ifstream file(*folder / "capture_2000hz.bin", std::ios::binary);
    return Bytes{std::istreambuf_iterator<char>(file), {}};
  }
  static Bytes datagram(const Bytes& capture, std::size_t i) {
    const auto at = capture.begin() + static_cast<std::ptrdiff_t>(i * kPitch);
    return {at, at + kSize};
  }
};

}  // namespace plumb::test
