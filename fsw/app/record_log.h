#pragma once
// Encodes records into a static buffer and hands them to the log. The log never holds up navigation: what it has no
// room for is counted there, and marked in the file.

#include <array>

#include "fsw/telemetry/messages.h"
#include "hal/include/log_sink.h"

namespace plumb {

class RecordLog {
 public:
  /// `sink` must outlive this object.
  explicit RecordLog(LogSink& sink) : sink_(sink) {}

  template <class... Record>
  void write(const char* channel, Time t, const Record&... record) {
    const Result<std::size_t> size = encode(record..., MessageBuffer(buffer_));
    PLUMB_ASSERT(size.has_value());  // the buffer holds every record
    static_cast<void>(sink_.write(channel, t, MessageBytes(buffer_.data(), *size)));
  }

 private:
  LogSink& sink_;
  std::array<std::uint8_t, kMaxMessageBytes> buffer_{};
};

}  // namespace plumb
