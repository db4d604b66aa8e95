#pragma once
// Where the flight software's messages go: a network, a test, nowhere.

#include <cstdint>
#include <span>

#include "fsw/base/status.h"

namespace plumb {

class TelemetrySink {
 public:
  virtual ~TelemetrySink() = default;
  /// Sends one encoded message; `message` may be reused as soon as the call returns. Never waits for a receiver.
  /// kRejected when the transport refused it: the message is lost, and the next one may be sent.
  virtual Status publish(const char* channel, std::span<const std::uint8_t> message) = 0;
  /// The system's error number (errno) of the last message that was lost; 0 when none was, or the system was not asked.
  virtual int last_error() const = 0;
};

}  // namespace plumb
