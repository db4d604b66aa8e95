#include "tools/hil/video_output.h"

#include <linux/videodev2.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace plumb::hil {

std::unique_ptr<VideoOutput> VideoOutput::open(const std::string& device, int width, int height, std::string& error) {
  auto output = std::make_unique<VideoOutput>();
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
  v4l2_pix_format& pixels = format.fmt.pix;
  pixels.width = static_cast<std::uint32_t>(width);
  pixels.height = static_cast<std::uint32_t>(height);
  pixels.pixelformat = V4L2_PIX_FMT_GREY;
  pixels.field = V4L2_FIELD_NONE;
  pixels.bytesperline = pixels.width;
  pixels.sizeimage = pixels.width * pixels.height;
  int reason = output->file_.open(device);
  if (reason == 0) reason = output->file_.call(VIDIOC_S_FMT, &format);
  // The driver may round the size of its buffers up, but rows stay rows.
  const auto row = static_cast<std::uint32_t>(width);
  const bool is_as_asked = pixels.pixelformat == V4L2_PIX_FMT_GREY && pixels.width == row &&
                           pixels.height == static_cast<std::uint32_t>(height) && pixels.bytesperline == row;
  if (reason == 0 && !is_as_asked) reason = EINVAL;
  if (reason == 0) return output;
  error = device + ": takes no grey images of " + std::to_string(width) + " x " + std::to_string(height) + ": " +
          std::strerror(reason);
  return nullptr;
}

bool VideoOutput::write(std::span<const std::uint8_t> pixels) {
  return ::write(file_.get(), pixels.data(), pixels.size()) == static_cast<ssize_t>(pixels.size());
}

}  // namespace plumb::hil
