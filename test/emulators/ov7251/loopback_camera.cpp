#include "test/emulators/ov7251/loopback_camera.h"

#include <fcntl.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <unistd.h>

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

void LoopbackCamera::pull() { thread_ = {}; }

void LoopbackCamera::put_back() {
  const int file = open(device_.c_str(), O_RDWR | O_CLOEXEC);
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
  format.fmt.pix.width = Ov7251Emulator::kWidth;
  format.fmt.pix.height = Ov7251Emulator::kHeight;
  format.fmt.pix.pixelformat = V4L2_PIX_FMT_GREY;
  format.fmt.pix.field = V4L2_FIELD_NONE;
  format.fmt.pix.bytesperline = Ov7251Emulator::kWidth;
  format.fmt.pix.sizeimage = Ov7251Emulator::kWidth * Ov7251Emulator::kHeight;
  if (file < 0 || ioctl(file, VIDIOC_S_FMT, &format) != 0 || format.fmt.pix.pixelformat != V4L2_PIX_FMT_GREY) {
    if (file >= 0) close(file);
    throw std::runtime_error(device_ + ": is no v4l2loopback device that takes grey images: " + std::strerror(errno));
  }
  thread_ = std::jthread([this, file](const std::stop_token& stop) { run(stop, file); });
}

void LoopbackCamera::run(const std::stop_token& stop, int file) {
  auto next = std::chrono::steady_clock::now();
  std::vector<std::uint8_t> image;
  while (!stop.stop_requested()) {
    image = images_[static_cast<std::size_t>(next_index_ % kImages)];
    std::memcpy(image.data(), &next_index_, kIndexBytes);
    if (write(file, image.data(), image.size()) == static_cast<ssize_t>(image.size())) ++next_index_;
    next = std::max(next + std::chrono::nanoseconds(kPeriod_ns), std::chrono::steady_clock::now());
    std::this_thread::sleep_until(next);
  }
  close(file);
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
