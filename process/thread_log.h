#pragma once
// The queue of a thread's log records with the memory behind it, and how much each thread needs.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "hal/include/queued_log.h"

namespace plumb {

/// Bytes: a second and more of each thread's records, and two tenths of a second of the largest images.
/// All of it stays in memory, which is locked.
struct LogSizes {
  static constexpr std::size_t kDevice = std::size_t{128} << 10;
  static constexpr std::size_t kNav = std::size_t{256} << 10;
  static constexpr std::size_t kTick = std::size_t{1} << 20;
  static constexpr std::size_t kImages = std::size_t{2} << 20;
};

struct ThreadLog {
  ThreadLog(const char* name, std::size_t bytes) : storage(bytes), log(name, storage) {}
  std::vector<std::uint8_t> storage;
  QueuedLog log;
};

}  // namespace plumb
