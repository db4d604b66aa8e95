#pragma once
// The flight clock on Linux.

#include <time.h>

#include <cstdint>

#include "fsw/base/time.h"

namespace plumb {

inline Time to_time(const timespec& t) {
  constexpr std::int64_t kNsPerSecond = 1'000'000'000;
  return Time::from_ns(static_cast<std::int64_t>(t.tv_sec) * kNsPerSecond + t.tv_nsec);
}

/// CLOCK_MONOTONIC or another clock, now.
inline Time clock_now(clockid_t clock = CLOCK_MONOTONIC) {
  timespec t{};
  clock_gettime(clock, &t);  // fails only for clocks that do not exist
  return to_time(t);
}

}  // namespace plumb
