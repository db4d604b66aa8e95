#pragma once
// A LIDAR-Lite on a bus.

#include "drivers/lidar_lite/protocol.h"
#include "hal/include/i2c_bus.h"

namespace plumb::lidar_lite {

class Device {
 public:
  /// `bus` must outlive the device. Precondition: options within their limits (protocol.h).
  Device(I2cBus& bus, const Options& options) : bus_(bus), protocol_(options) {}

  /// Does the transfers that are due at `now`, on the flight clock. Returns a sample when one came of them, else
  /// kNotReady. Ends after a sample, at the first transfer that fails, and after kMaxTransfers at the latest, so that
  /// it blocks for one timeout of the bus at most. Call it again at wake().
  Result<RangeSample> poll(Time now);

  Time wake() const { return protocol_.wake(); }
  bool measuring() const { return protocol_.measuring(); }
  const Counters& counters() const { return protocol_.counters(); }

 private:
  /// Identity, preset and its verification of the model with most registers, without a pause between them.
  static constexpr int kMaxTransfers = 8;

  Transfer run(const Request& request, Time now);

  I2cBus& bus_;
  Protocol protocol_;
};

}  // namespace plumb::lidar_lite
