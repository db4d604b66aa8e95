#pragma once
// An I2C bus with this host as its only master, one transfer at a time.

#include <cstdint>
#include <span>

#include "fsw/base/status.h"
#include "fsw/base/time.h"

namespace plumb {

class I2cBus {
 public:
  virtual ~I2cBus() = default;

  /// START, address, the bytes, STOP: one transfer, never joined to the next by a repeated start, which the LIDAR-Lite
  /// v3 does not take. Returns the flight clock at the STOP. kRejected: the device did not acknowledge, the bus failed,
  /// or its adapter is gone; last_error() has the reason, and later calls try to come back by themselves. Waits no
  /// longer than the bus's own timeout, which the implementation states.
  virtual Result<Time> write(std::uint8_t address, std::span<const std::uint8_t> bytes) = 0;
  /// START, address, as many bytes as the buffer holds, STOP. As write(); after kRejected the buffer means nothing.
  virtual Result<Time> read(std::uint8_t address, std::span<std::uint8_t> bytes) = 0;
  /// Whether the adapter itself is gone, with all that is on its bus.
  virtual bool is_gone() const = 0;
  /// The system's error number (errno) of the last transfer that failed; 0 when none has.
  virtual int last_error() const = 0;
};

}  // namespace plumb
