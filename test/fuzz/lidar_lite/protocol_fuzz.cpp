// Any answers of the device: the state machine goes on asking, pauses no longer than it may, and takes nothing for a
// range that is out of the model's reach. Input: the model, then for each transfer an answer: 0xFF refuses it, anything
// else acknowledges; a read takes one byte more for each byte it wants.

#include <cstddef>
#include <cstdint>

#include "drivers/lidar_lite/protocol.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace plumb;
  using namespace plumb::lidar_lite;
  if (size == 0) return 0;
  const auto model = static_cast<Model>(data[0] % 3);
  Protocol protocol({.model = model, .bias_period = 1 + data[0] % kMaxBiasPeriod});
  Time now = Time::from_ns(1'000'000'000);
  std::size_t at = 1;
  const auto take = [&] { return at < size ? data[at++] : std::uint8_t{0}; };
  while (at < size) {
    const Request request = protocol.next(now);
    if (request.kind == Request::Kind::kWait) {
      PLUMB_ASSERT(protocol.wake() > now && protocol.wake() - now <= kMaxBackOffPause);
      now = protocol.wake();
      continue;
    }
    now = now + Duration::from_us(75);
    Transfer transfer;
    transfer.t_stop = now;
    transfer.is_read = request.kind == Request::Kind::kRead;
    transfer.acknowledged = take() != 0xFF;
    if (transfer.is_read) {
      PLUMB_ASSERT(request.size == 1 || request.size == 2);
      transfer.bytes.resize(request.size);
      for (std::uint8_t& byte : transfer.bytes) byte = take();
    } else {
      for (const std::uint8_t byte : request.bytes) PLUMB_ASSERT(ok(transfer.bytes.push_back(byte)));
    }
    const auto sample = protocol.complete(transfer);
    if (sample && sample->quality == RangeQuality::kValid) {
      PLUMB_ASSERT(sample->range_m >= 0.05 && sample->range_m <= (model == Model::kV4Led ? 10.0 : 40.0));
      PLUMB_ASSERT(sample->t < now);
    }
  }
  return 0;
}
