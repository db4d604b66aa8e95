#include "drivers/stim300/device.h"

namespace plumb::stim300 {

Status Device::poll(Time now, Duration timeout, Samples& samples) {
  samples.clear();
  if (protocol_.state() == State::kUnconfigured && now >= t_request_) {
    t_request_ = now + kRequestPeriod;
    constexpr std::array<std::uint8_t, 2> kTellConfiguration = {'C', '\r'};
    // A request that does not get through is repeated; one to a unit that is still starting is answered unasked.
    const Status asked = port_.write(kTellConfiguration, Duration());
    if (asked == Status::kRejected) return asked;
  }
  const Result<SerialChunk> chunk = port_.read(buffer_, timeout);
  if (chunk.status() == Status::kNotReady) protocol_.feed({}, now, samples);
  if (!chunk) return chunk.status();
  t_arrived_ = chunk->t;
  protocol_.feed(std::span(buffer_).first(chunk->size), chunk->t, samples);
  return Status::kOk;
}

}  // namespace plumb::stim300
