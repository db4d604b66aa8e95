#include "drivers/ov7251/device.h"

namespace plumb::ov7251 {

Status Device::start() {
  const CameraMode mode = protocol_.mode();
  const Result<CameraMode> taken = port_.start(mode);
  protocol_.start(taken ? taken->period : mode.period);
  return taken.status();
}

void Device::set_exposure(Time now) {
  if (protocol_.wanted().time == Duration()) return;
  const Result<Exposure> taken = port_.set_exposure(protocol_.wanted());
  taken ? protocol_.on_exposure_set(*taken, now) : protocol_.on_exposure_refused(port_.last_error());
}

Result<CameraFrame> Device::poll(Time now, Duration timeout) {
  set_exposure(now);
  const Result<PortFrame> received = port_.receive(timeout);
  const FaultCounter& lost = port_.health().exposures_lost;
  if (lost != exposures_lost_) protocol_.on_exposure_refused(static_cast<int>(lost.value));
  exposures_lost_ = lost;
  if (!received) return received.status();
  return protocol_.on_frame(*received);
}

}  // namespace plumb::ov7251
