#pragma once
// The system calls of Video4Linux that a grey camera takes: capture through buffers shared with the driver, and the
// controls of a sensor. Each call returns 0 or the error number. Source: Linux, Documentation/userspace-api/media/v4l.

#include <array>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <string>

#include "fsw/base/time.h"
#include "hal/linux/grey_image.h"

namespace plumb {

/// An open device file, closed with its owner.
class DeviceFile {
 public:
  DeviceFile() = default;
  ~DeviceFile() { close(); }
  DeviceFile(const DeviceFile&) = delete;
  DeviceFile& operator=(const DeviceFile&) = delete;

  int open(const std::string& device);
  void close();
  bool is_open() const { return file_ >= 0; }
  int get() const { return file_; }
  /// ioctl(2), again when a signal came in between.
  int call(unsigned long request, void* argument) const;

 private:
  int file_ = -1;
};

/// A filled buffer.
struct V4l2Image {
  std::uint32_t index = 0;
  std::span<const std::uint8_t> bytes;  ///< of the image, in the buffer
  Time t;
  std::uint32_t flags = 0;  ///< V4L2_BUF_FLAG_*: clock and kind of the stamp, error
  std::uint32_t sequence = 0;
};

class V4l2Capture {
 public:
  static constexpr std::size_t kMaxBuffers = 8;

  ~V4l2Capture() { close(); }

  /// ENODEV: it captures no video, or does not stream.
  int open(const std::string& device);
  void close();
  const DeviceFile& file() const { return file_; }
  /// Whether stamps are when the first bytes of an image came, whatever their flags say of it.
  bool stamps_first_bytes() const { return stamps_first_bytes_; }

  /// EINVAL: the driver takes another size or format only. `agreed` is filled but for its bytes.
  int set_format(GreyFormat format, std::int32_t width, std::int32_t height, RawImage& agreed);
  /// Shares `buffers` with the driver, or as many as it gives, queues them and starts.
  int stream_on(std::uint32_t buffers);
  void stream_off();
  /// EAGAIN: none is filled. The buffer is the caller's until queue().
  int dequeue(V4l2Image& image);
  int queue(std::uint32_t index);
  /// Sets the time from frame to frame, which becomes the one that the driver took.
  int set_period(Duration& period);

 private:
  struct Buffer {
    void* memory = nullptr;
    std::size_t size = 0;
  };
  int map(std::uint32_t index);
  std::uint32_t type() const;

  DeviceFile file_;
  bool multi_planar_ = false;
  bool stamps_first_bytes_ = false;
  std::array<Buffer, kMaxBuffers> buffers_{};
  std::uint32_t count_ = 0;
};

/// An integer control of a driver, in the driver's own unit.
struct V4l2Control {
  std::uint32_t id = 0;
  std::int32_t least = 0;
  std::int32_t most = 0;
  std::int32_t step = 1;
};

/// The first of these controls that can be written, at the latest once the camera does not set it by itself. EINVAL:
/// there is none.
int find_control(const DeviceFile& file, std::initializer_list<std::uint32_t> ids, V4l2Control& control);
/// Writes a value, which becomes the one that the control has then: a driver moves it into its limits, and some devices
/// into steps that they do not tell.
int write_control(const DeviceFile& file, std::uint32_t id, std::int32_t& value);
/// Gives a control this value where it exists and has another. 0 too where it does not exist.
int settle_control(const DeviceFile& file, std::uint32_t id, std::int32_t value);
/// Sets the frame interval of a sensor's sub-device, which becomes the one that the driver took.
int set_sensor_period(const DeviceFile& sensor, Duration& period);

}  // namespace plumb
