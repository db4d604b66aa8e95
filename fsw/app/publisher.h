#pragma once
// Encodes records into a static buffer and hands them to a telemetry sink, each on its channel. Telemetry never holds
// up navigation: what cannot be sent is counted and forgotten.

#include <array>
#include <cstdint>

#include "fsw/app/telemetry_table.h"
#include "hal/include/telemetry_sink.h"

namespace plumb {

class Publisher {
 public:
  /// `sink` must outlive this object.
  explicit Publisher(TelemetrySink& sink) : sink_(sink) {}

  template <class Record>
  void publish(const Record& record) {
    const Result<std::size_t> size = encode(record, buffer_);
    PLUMB_ASSERT(size.has_value());  // the buffer holds every record
    if (ok(sink_.publish(kTelemetryRow<Record>.channel, MessageBytes(buffer_.data(), *size)))) {
      ++sent_;
    } else {
      ++lost_;
    }
  }

  std::uint64_t sent() const { return sent_; }
  std::uint64_t lost() const { return lost_; }

 private:
  TelemetrySink& sink_;
  std::array<std::uint8_t, kMaxMessageBytes> buffer_{};
  std::uint64_t sent_ = 0;
  std::uint64_t lost_ = 0;
};

}  // namespace plumb
