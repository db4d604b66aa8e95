// libFuzzer on all that a STIM300's line can say. The first byte chooses how the rest is cut into reads; whatever
// comes, no assertion breaks, every byte is accounted for, and what is handed out as a datagram is one.

#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/stim300/protocol.h"

namespace plumb::stim300 {
namespace {

void check_framer(std::span<const std::uint8_t> bytes) {
  Framer framer;
  Frame frame;
  std::uint64_t in_datagrams = 0;
  const auto take_out = [&] {
    while (framer.next(frame)) {
      PLUMB_ASSERT(layout_of(frame.bytes[0]).size == frame.bytes.size());
      PLUMB_ASSERT(checksum_holds(frame.bytes));
      in_datagrams += frame.bytes.size();
    }
  };
  for (const std::uint8_t byte : bytes) {
    framer.push(byte, Time());
    take_out();
  }
  framer.finish();
  take_out();
  const FramerCounters& counters = framer.counters();
  const std::uint64_t accounted = in_datagrams + counters.skipped_bytes;
  PLUMB_ASSERT(accounted <= bytes.size());
  PLUMB_ASSERT(accounted + 2 * counters.datagrams >= bytes.size());  // CR LF
}

void check_protocol(std::span<const std::uint8_t> bytes, std::size_t chunk) {
  Protocol protocol{Settings{}};
  Samples samples;
  Time t = Time::from_ns(1'000'000'000);
  Time t_last = Time::never();
  while (!bytes.empty()) {
    const std::size_t size = chunk < bytes.size() ? chunk : bytes.size();
    t = t + Duration::from_us(static_cast<std::int64_t>(bytes[0]) * 100);
    protocol.feed(bytes.first(size), t, samples);
    for (const ImuSample& sample : samples) {
      PLUMB_ASSERT(sample.t > t_last && sample.t < t);
      t_last = sample.t;
    }
    bytes = bytes.subspan(size);
  }
}

}  // namespace
}  // namespace plumb::stim300

// A checksum is hardly guessed, so a datagram that ends in 0x00 gets the right one: what is behind it is reached too.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace plumb::stim300;
  if (size == 0 || size > 4096) return 0;
  static std::uint8_t bytes[4096];
  for (std::size_t i = 0; i < size; ++i) bytes[i] = data[i];
  for (std::size_t at = 1; at < size;) {
    const std::size_t length = layout_of(bytes[at]).size;
    if (length == 0 || at + length > size || bytes[at + length - 1] != 0) {
      ++at;
      continue;
    }
    const std::uint32_t crc = checksum({bytes + at, length - kChecksumBytes});
    for (std::size_t i = 0; i < kChecksumBytes; ++i) {
      bytes[at + length - kChecksumBytes + i] = static_cast<std::uint8_t>(crc >> (24 - 8 * i));
    }
    at += length;
  }
  check_framer({bytes + 1, size - 1});
  check_protocol({bytes + 1, size - 1}, 1U + bytes[0] % kMaxChunkBytes);
  return 0;
}
