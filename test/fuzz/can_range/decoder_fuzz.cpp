// Any frames on the bus, in both protocols: a valid range is a positive number.
// Input: per frame a byte of node, size and step of time, then eight data bytes. The first byte chooses the protocol.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "drivers/can_range/decoder.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace plumb;
  if (size == 0) return 0;
  const bool native = (data[0] & 1) != 0;
  can_range::Options options;
  options.protocol = native ? can_range::Protocol::kBenewake : can_range::Protocol::kDronecan;
  can_range::Decoder decoder(options);
  constexpr std::size_t kRecord = 1 + kCanMaxDataBytes;
  Time t = Time::from_ns(1'000'000'000);
  for (std::size_t at = 1; at + kRecord <= size; at += kRecord) {
    const std::uint8_t head = data[at];
    CanFrame frame;
    frame.is_extended = !native;
    frame.id = native ? options.benewake_id : 0x10041A00U | (head >> 4U & 0x7U);
    frame.size = std::min<std::uint8_t>(head & 0xF, kCanMaxDataBytes);
    std::copy_n(data + at + 1, kCanMaxDataBytes, frame.bytes.begin());
    t = t + ((head & 0x80U) != 0 ? Duration::from_ms(60) : Duration::from_us(131));
    const auto reading = decoder.decode({t, frame});
    if (reading && reading->sample.quality == RangeQuality::kValid) {
      PLUMB_ASSERT(std::isfinite(reading->sample.range_m) && reading->sample.range_m > 0.0);
    }
    if (reading) PLUMB_ASSERT(reading->sample.t <= t);
  }
  return 0;
}
