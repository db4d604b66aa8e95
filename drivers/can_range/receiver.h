#pragma once
// A range finder on a CAN bus.

#include "drivers/can_range/decoder.h"
#include "hal/include/can_socket.h"

namespace plumb::can_range {

class Receiver {
 public:
  /// `socket` must outlive the receiver, and is its alone to receive from. Precondition: options within their limits.
  Receiver(CanSocket& socket, const Options& options) : socket_(socket), decoder_(options) {}

  /// Sets the socket's filter. As CanSocket::set_filters().
  Status start();
  /// The next reading, waiting at most `timeout` for a frame. kNotReady: none yet. kRejected: the bus is not there, or
  /// what came was counted as bad. Looks at kMaxFrames at most, so that a bus full of frames does not hold it.
  Result<Reading> poll(Duration timeout);

  const Decoder& decoder() const { return decoder_; }

 private:
  static constexpr int kMaxFrames = 64;

  CanSocket& socket_;
  Decoder decoder_;
};

}  // namespace plumb::can_range
