#pragma once
// What the threads that receive and the tick task share: one ring per device for its samples and one for its faults,
// the log's among them, one for commands, a store of images whose slots go round, and the mode.

#include <array>
#include <atomic>
#include <cstdint>

#include "fsw/base/mission_config.h"
#include "fsw/base/spsc_ring.h"
#include "fsw/events/device_faults.h"
#include "fsw/measurement/input_frame.h"
#include "fsw/measurement/nav_state.h"

namespace plumb {

/// An image in the store. The camera's thread takes an empty slot, fills it and hands it to the tick task, which gives
/// it back when the nav job is done with it.
struct StoredImage {
  CameraReference reference;
  std::uint8_t slot = 0;
  std::int32_t width = 0;   ///< px
  std::int32_t height = 0;  ///< px

  ImageView view(const std::uint8_t* pixels) const {
    return {.pixels = pixels, .width = width, .height = height, .stride = width};
  }
};

/// A sample, and when its last byte was read from the line: its own stamp is of when it was measured.
struct ReceivedImu {
  ImuSample sample;
  Time t_arrival;
};

struct SensorRings {
  /// One is filled, one on its way, one waits, one is worked on.
  static constexpr std::size_t kImageSlots = 4;

  SensorRings() {
    for (std::uint8_t slot = 0; slot < kImageSlots; ++slot) static_cast<void>(empty.push(slot));
  }

  SpscRing<ReceivedImu, 512> imu;  ///< 2 s at 250 Hz
  SpscRing<RangeSample, 64> range;
  SpscRing<Command, 16> commands;
  DeviceFaultRing imu_faults;
  DeviceFaultRing camera_faults;
  DeviceFaultRing range_faults;
  DeviceFaultRing log_faults;
  SpscRing<StoredImage, kImageSlots> images;  ///< camera to tick
  SpscRing<std::uint8_t, kImageSlots> empty;  ///< tick to camera
  std::array<std::array<std::uint8_t, FlightConfig::kMaxImageWidth * FlightConfig::kMaxImageHeight>, kImageSlots>
      pixels{};
  std::atomic<NavMode> mode{NavMode::kInitialising};  ///< tick to whom it concerns: that of the newest tick
};

}  // namespace plumb
