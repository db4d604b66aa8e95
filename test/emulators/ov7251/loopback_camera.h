#pragma once
// The emulated sensor's images into a v4l2loopback device, from which any program captures them as from a camera.

#include <cstdint>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "fsw/measurement/samples.h"
#include "tools/hil/video_output.h"

namespace plumb::emulator {

class LoopbackCamera {
 public:
  static constexpr const char* kDevice = "/dev/video9";
  static constexpr std::int64_t kPeriod_ns = 50'000'000;

  /// Writes an image every period from now on. Throws where the device does not take them.
  explicit LoopbackCamera(const std::string& device = kDevice);
  ~LoopbackCamera() { pull(); }

  /// The camera is gone until put_back().
  void pull();
  void put_back();
  /// Which of the images this is, counted from 0, when it is one in every byte; else -1.
  std::int64_t index_of(const ImageView& image) const;

 private:
  // Made before the first is sent: an emulated processor is too slow to make them on the way.
  static constexpr int kImages = 8;
  /// The index is in the first pixels.
  static constexpr int kIndexBytes = 8;

  void run(const std::stop_token& stop);

  std::string device_;
  std::vector<std::vector<std::uint8_t>> images_;
  std::int64_t next_index_ = 0;
  std::unique_ptr<hil::VideoOutput> output_;
  std::jthread thread_;  // last: it uses the others
};

}  // namespace plumb::emulator
