#pragma once
// A STIM300 on a serial line.

#include <array>
#include <cstdint>

#include "drivers/stim300/protocol.h"
#include "hal/include/serial_port.h"

namespace plumb::stim300 {

class Device {
 public:
  /// `port` must outlive the device. Preconditions as Protocol.
  Device(SerialPort& port, const Settings& expected) : port_(port), protocol_(expected) {}

  /// Reads the line once, waiting for bytes at most `timeout`, and replaces `samples` by those that this completes.
  /// `now` is the flight clock. As long as the unit has not told its configuration it is asked for it, twice a second.
  /// kNotReady: no byte came. kRejected: the line is gone; the port has the reason.
  Status poll(Time now, Duration timeout, Samples& samples);

  /// When the bytes of the newest poll() that found any were read from the line, on the flight clock.
  Time arrived() const { return t_arrived_; }
  const Protocol& protocol() const { return protocol_; }

 private:
  static constexpr Duration kRequestPeriod = Duration::from_ms(500);

  SerialPort& port_;
  Protocol protocol_;
  Time t_request_ = Time::never();
  Time t_arrived_ = Time::never();
  std::array<std::uint8_t, kMaxChunkBytes> buffer_{};
};

}  // namespace plumb::stim300
