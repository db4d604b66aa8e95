#pragma once
// The flight clock on Linux, and waiting by it.

#include <poll.h>
#include <time.h>

#include <algorithm>
#include <cstdint>

#include "fsw/base/time.h"

namespace plumb {

inline Time to_time(const timespec& t) {
  return Time::from_ns(static_cast<std::int64_t>(t.tv_sec) * kNsPerSecond + t.tv_nsec);
}

/// CLOCK_MONOTONIC or another clock, now.
inline Time clock_now(clockid_t clock = CLOCK_MONOTONIC) {
  timespec t{};
  clock_gettime(clock, &t);  // fails only for clocks that do not exist
  return to_time(t);
}

/// Waits until the file is ready for one of the events, at most `timeout`; zero or less does not wait. A negative file
/// only waits. Returns what ppoll() does.
inline int wait_for(int file, short events, Duration timeout) {
  const std::int64_t ns = std::max<std::int64_t>(timeout.ns(), 0);
  const timespec wait{.tv_sec = static_cast<time_t>(ns / kNsPerSecond),
                      .tv_nsec = static_cast<long>(ns % kNsPerSecond)};
  pollfd waiting{.fd = file, .events = events, .revents = 0};
  return ppoll(&waiting, 1, &wait, nullptr);
}

}  // namespace plumb
