#include "test/emulators/ov7251/loopback_camera.h"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <stdexcept>

#include "test/emulators/ov7251/ov7251_emulator.h"

namespace plumb::emulator {

LoopbackCamera::LoopbackCamera(const std::string& device) : device_(device) {
  Ov7251Emulator sensor(0, 7);
  sensor.set_scene([](int u, int v) { return 0.01 + 0.04 * ((u / 16 + v / 16) % 2); });
  for (int i = 0; i < kImages; ++i) images_.push_back(as_grey(*sensor.next_image()));
  put_back();
}

void LoopbackCamera::pull() {
  thread_ = {};
  output_.reset();
}

void LoopbackCamera::put_back() {
  std::string error;
  output_ = hil::VideoOutput::open(device_, Ov7251Emulator::kWidth, Ov7251Emulator::kHeight, error);
  if (output_ == nullptr) throw std::runtime_error(error);
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

void LoopbackCamera::run(const std::stop_token& stop) {
  auto next = std::chrono::steady_clock::now();
  std::vector<std::uint8_t> image;
  while (!stop.stop_requested()) {
    image = images_[static_cast<std::size_t>(next_index_ % kImages)];
    std::memcpy(image.data(), &next_index_, kIndexBytes);
    if (output_->write(image)) ++next_index_;
    next = std::max(next + std::chrono::nanoseconds(kPeriod_ns), std::chrono::steady_clock::now());
    std::this_thread::sleep_until(next);
  }
}

std::int64_t LoopbackCamera::index_of(const ImageView& image) const {
  std::int64_t index = 0;
  std::memcpy(&index, image.pixels, kIndexBytes);
  if (index < 0 || image.width != Ov7251Emulator::kWidth || image.height != Ov7251Emulator::kHeight) return -1;
  const std::vector<std::uint8_t>& sent = images_[static_cast<std::size_t>(index % kImages)];
  for (int v = 0; v < image.height; ++v) {
    const int skipped = v == 0 ? kIndexBytes : 0;
    const std::uint8_t* const row = image.pixels + static_cast<std::ptrdiff_t>(v) * image.stride;
    const auto expected = sent.begin() + v * image.width;
    if (!std::equal(row + skipped, row + image.width, expected + skipped)) return -1;
  }
  return index;
}

}  // namespace plumb::emulator
