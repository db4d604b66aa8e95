#include "drivers/lidar_lite/device.h"

#include <span>

namespace plumb::lidar_lite {

Transfer Device::run(const Request& request, Time now) {
  Transfer transfer;
  transfer.is_read = request.kind == Request::Kind::kRead;
  if (transfer.is_read) {
    transfer.bytes.resize(request.size);
  } else {
    for (const std::uint8_t byte : request.bytes) (void)transfer.bytes.push_back(byte);  // two fit
  }
  const std::span<std::uint8_t> bytes(transfer.bytes.data(), transfer.bytes.size());
  const Result<Time> stop = transfer.is_read ? bus_.read(kAddress, bytes) : bus_.write(kAddress, bytes);
  transfer.acknowledged = stop.has_value();
  transfer.t_stop = stop ? *stop : now;
  return transfer;
}

Result<RangeSample> Device::poll(Time now) {
  for (int i = 0; i < kMaxTransfers; ++i) {
    const Request request = protocol_.next(now);
    if (request.kind == Request::Kind::kWait) break;
    const Transfer transfer = run(request, now);
    const Result<RangeSample> sample = protocol_.complete(transfer);
    if (sample || !transfer.acknowledged) return sample;
    now = transfer.t_stop;
  }
  return Status::kNotReady;
}

}  // namespace plumb::lidar_lite
