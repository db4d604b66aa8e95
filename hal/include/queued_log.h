#pragma once
// The log as a flight thread sees it: a queue that a writer empties. What does not fit is dropped and counted, because
// nothing in flight waits for a disk.

#include "fsw/base/record_ring.h"
#include "hal/include/log_sink.h"

namespace plumb {

class QueuedLog final : public LogSink {
 public:
  /// One thread writes to it. `name` must outlive it.
  QueuedLog(const char* name, std::span<std::uint8_t> storage) : name_(name), ring_(storage) {}

  /// kFull: dropped.
  Status write(const char* channel, Time t, std::span<const std::uint8_t> message) override {
    return ring_.push(channel, t, message);
  }
  int last_error() const override { return 0; }

  const char* name() const { return name_; }
  RecordRing& ring() { return ring_; }

 private:
  const char* name_;
  RecordRing ring_;
};

}  // namespace plumb
