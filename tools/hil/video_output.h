#pragma once
// Grey images into a video output device, such as v4l2loopback, from which any program captures them as from a camera.

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "hal/linux/v4l2_device.h"

namespace plumb::hil {

class VideoOutput {
 public:
  /// Null, and the reason in `error`, where the device does not take grey images of that size [px].
  static std::unique_ptr<VideoOutput> open(const std::string& device, int width, int height, std::string& error);

  /// Pixels by rows, without gaps. False: the device did not take all of them.
  bool write(std::span<const std::uint8_t> pixels);

 private:
  DeviceFile file_;
};

}  // namespace plumb::hil
