#include "drivers/can_range/receiver.h"

#include <array>

namespace plumb::can_range {

Status Receiver::start() {
  const std::array filters{decoder_.filter()};
  return socket_.set_filters(filters);
}

Result<Reading> Receiver::poll(Duration timeout) {
  for (int i = 0; i < kMaxFrames; ++i) {
    const Result<ReceivedCanFrame> received = socket_.receive(i == 0 ? timeout : Duration());
    if (!received) return received.status();
    const Result<Reading> reading = decoder_.decode(*received);
    if (reading || reading.status() != Status::kNotReady) return reading;
  }
  return Status::kNotReady;
}

}  // namespace plumb::can_range
