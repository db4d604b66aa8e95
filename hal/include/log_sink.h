#pragma once
// Where the log goes: every input before it is used, every output after.

#include <cstdint>
#include <span>

#include "fsw/base/status.h"
#include "fsw/base/time.h"

namespace plumb {

class LogSink {
 public:
  virtual ~LogSink() = default;
  /// Appends one encoded message with its time; `message` may be reused as soon as the call returns. kRejected when it
  /// could not be written (a full disk): the log is then incomplete.
  virtual Status write(const char* channel, Time t, std::span<const std::uint8_t> message) = 0;
  /// The system's error number (errno) of the last write that failed; 0 when none has, or the system was not asked.
  virtual int last_error() const = 0;
};

}  // namespace plumb
