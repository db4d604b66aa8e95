#pragma once
// The samples of a live flight once more from the bytes of its devices, through the drivers. Which of them belong to
// which tick was decided by threads; that is taken from the input frames, and nothing else.

#include <deque>
#include <string>
#include <string_view>

#include "config/flight_config.h"
#include "drivers/can_range/decoder.h"
#include "drivers/lidar_lite/capture.h"
#include "drivers/stim300/protocol.h"
#include "fsw/telemetry/messages.h"

namespace plumb::replay {

class RawSamples {
 public:
  /// `setup`: that of the flight; it says which devices spoke.
  explicit RawSamples(const FlightSetup& setup);

  /// Takes a message of a device, and passes over any other. False: it is none.
  bool take(std::string_view channel, MessageBytes message);
  /// Puts the drivers' samples in the place of the frame's. Empty, or why that cannot be: a sample that the drivers do
  /// not make. Samples that the flight never took, because a ring was full, are passed over.
  std::string replace_samples(InputFrame& input);

 private:
  bool take_serial(MessageBytes message);
  bool take_transfer(MessageBytes message);
  bool take_can_frame(MessageBytes message);

  stim300::Protocol stim300_;
  lidar_lite::Capture capture_;
  can_range::Decoder can_;
  std::deque<ImuSample> imu_;
  std::deque<RangeSample> range_;
};

}  // namespace plumb::replay
