#pragma once
// Transfers of an I2C bus as the kernel's tracing tells them, whoever does them: the text of /sys/kernel/tracing/trace
// with the events i2c_write, i2c_read, i2c_reply and i2c_result. Source: Linux, include/trace/events/i2c.h.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "fsw/base/time.h"

namespace plumb::decode {

/// One transfer, START to STOP.
struct I2cTransfer {
  Time t_stop;  ///< by the clock of the trace
  bool is_read = false;
  bool acknowledged = false;
  std::vector<std::uint8_t> bytes;
};

struct I2cTraceCounters {
  std::uint64_t transfers = 0;        ///< with the device
  std::uint64_t others = 0;           ///< transfers with other devices, or of several messages
  std::uint64_t malformed_lines = 0;  ///< that name an event and cannot be read
  std::uint64_t other_lines = 0;      ///< that name none, comments of the trace included
};

class I2cTrace {
 public:
  explicit I2cTrace(int address) : address_(address) {}

  /// The transfer that this line completes; nothing for any other line.
  std::optional<I2cTransfer> take(const std::string& line);
  const I2cTraceCounters& counters() const { return counters_; }

 private:
  struct Event;
  static std::optional<Event> parse(const std::string& line, bool& names_an_event);
  std::optional<I2cTransfer> finish(const Event& result);

  int address_;
  int bus_ = -1;  ///< of the transfer that goes on
  int messages_ = 0;
  bool of_device_ = false;
  I2cTransfer transfer_;
  I2cTraceCounters counters_;
};

}  // namespace plumb::decode
