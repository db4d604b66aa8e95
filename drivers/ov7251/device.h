#pragma once
// An OV7251 behind a camera port.

#include "drivers/ov7251/protocol.h"
#include "hal/include/camera_port.h"

namespace plumb::ov7251 {

class Device {
 public:
  /// `port` must outlive the device. Precondition: as Protocol.
  Device(CameraPort& port, const Options& options) : port_(port), protocol_(options) {}

  /// Sets the mode and starts the stream; as CameraPort::start().
  Status start();
  /// The next camera frame, waiting at most `timeout` for it, on the flight clock at `now`. Its image is valid until
  /// the next call. kNotReady: none came. kRejected: the camera is gone, or what came was counted as bad. Sets the
  /// exposure where that has to change.
  Result<CameraFrame> poll(Time now, Duration timeout);

  const Protocol& protocol() const { return protocol_; }

 private:
  void set_exposure(Time now);

  CameraPort& port_;
  Protocol protocol_;
  std::uint64_t exposures_lost_ = 0;  ///< of the port, that are dealt with
};

}  // namespace plumb::ov7251
