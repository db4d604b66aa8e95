#pragma once
// Where nobody wants telemetry, or a log.

#include "hal/include/log_sink.h"
#include "hal/include/telemetry_sink.h"

namespace plumb {

class NoSink final : public TelemetrySink, public LogSink {
 public:
  Status publish(const char*, std::span<const std::uint8_t>) override { return Status::kOk; }
  Status write(const char*, Time, std::span<const std::uint8_t>) override { return Status::kOk; }
  int last_error() const override { return 0; }
};

}  // namespace plumb
