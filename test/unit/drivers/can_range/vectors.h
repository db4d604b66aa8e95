#pragma once
// Transfers in candump's notation, made with the public package dronecan 1.0.27, and the frames they stand for.

#include <string>
#include <vector>

#include "drivers/can_range/candump.h"

namespace plumb::test {

inline constexpr const char* kValid[] = {"10041A2A#0F8B000000000080", "10041A2A#0000000681002020", "10041A2A#11404A40"};
inline constexpr const char* kTooFar[] = {"18041A7D#3947CB04FB711F9F", "18041A7D#0100030181662A3F",
                                          "18041A7D#1300515F"};
inline constexpr const char* kTooClose[] = {"10041A07#0044605040302085", "10041A07#1000010000000025",
                                            "10041A07#02CD3445"};

/// Frames of the words, the first at `t`, 0.131 ms apart.
template <typename Words>
std::vector<ReceivedCanFrame> frames_of(const Words& words, Time t = Time::from_ns(0)) {
  std::vector<ReceivedCanFrame> frames;
  for (const char* word : words) {
    Result<ReceivedCanFrame> parsed = can_range::parse_candump_line("(0.000000) can0 " + std::string(word));
    frames.push_back({t, parsed.value().frame});
    t = t + Duration::from_us(131);
  }
  return frames;
}

}  // namespace plumb::test
