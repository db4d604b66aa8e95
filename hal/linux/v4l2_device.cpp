#include "hal/linux/v4l2_device.h"

#include <fcntl.h>
#include <linux/v4l2-subdev.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <string_view>

namespace plumb {
namespace {

constexpr std::uint32_t kVendorGrey = v4l2_fourcc('Y', '8', ' ', ' ');  // some vendors' name for GREY

std::span<const std::uint32_t> fourccs(GreyFormat format) {
  static constexpr std::array<std::uint32_t, 2> kGrey = {V4L2_PIX_FMT_GREY, kVendorGrey};
  static constexpr std::array<std::uint32_t, 1> kY10 = {V4L2_PIX_FMT_Y10};
  static constexpr std::array<std::uint32_t, 1> kY10Packed = {V4L2_PIX_FMT_Y10P};
  switch (format) {
    case GreyFormat::kGrey: return kGrey;
    case GreyFormat::kY10: return kY10;
    case GreyFormat::kY10Packed: return kY10Packed;
  }
  return {};
}

v4l2_fract to_fraction(Duration period) {
  constexpr std::int64_t kNsPerUs = 1000;
  return {.numerator = static_cast<std::uint32_t>(period.ns() / kNsPerUs), .denominator = 1'000'000};
}

Duration to_duration(const v4l2_fract& seconds, Duration otherwise) {
  if (seconds.numerator == 0 || seconds.denominator == 0) return otherwise;  // the driver does not say
  const Duration told = Duration::from_ns(std::int64_t{seconds.numerator} * kNsPerSecond / seconds.denominator);
  return told > Duration() ? told : otherwise;
}

/// The driver of USB cameras flags its stamps as those of the start of the exposure. That they are only when it goes by
/// the camera's clock, which it does not unless its option hwtimestamps is set.
/// Source: Linux, drivers/media/usb/uvc/uvc_video.c.
bool is_stamped_by_first_bytes(const v4l2_capability& capability) {
  if (std::string_view(reinterpret_cast<const char*>(capability.driver)) != "uvcvideo") return false;
  const int option = ::open("/sys/module/uvcvideo/parameters/hwtimestamps", O_RDONLY | O_CLOEXEC);
  char value = '0';
  const bool is_told = option >= 0 && read(option, &value, 1) == 1;
  if (option >= 0) ::close(option);
  return !is_told || value == '0' || value == 'N';
}

/// A buffer for a call, with room for its planes.
struct BufferCall {
  explicit BufferCall(std::uint32_t type) {
    buffer.type = type;
    buffer.memory = V4L2_MEMORY_MMAP;
    if (!multi_planar()) return;
    buffer.m.planes = planes.data();
    buffer.length = static_cast<std::uint32_t>(planes.size());
  }
  BufferCall(const BufferCall&) = delete;
  BufferCall& operator=(const BufferCall&) = delete;
  bool multi_planar() const { return buffer.type == V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE; }

  std::array<v4l2_plane, VIDEO_MAX_PLANES> planes{};
  v4l2_buffer buffer{};
};

}  // namespace

int DeviceFile::open(const std::string& device) {
  close();
  file_ = ::open(device.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  return file_ >= 0 ? 0 : errno;
}

void DeviceFile::close() {
  if (file_ >= 0) ::close(file_);
  file_ = -1;
}

int DeviceFile::call(unsigned long request, void* argument) const {
  constexpr int kMaxSignals = 100;
  for (int i = 0; i < kMaxSignals; ++i) {
    if (ioctl(file_, request, argument) == 0) return 0;
    if (errno != EINTR) return errno;
  }
  return EINTR;
}

std::uint32_t V4l2Capture::type() const {
  return multi_planar_ ? V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE : V4L2_BUF_TYPE_VIDEO_CAPTURE;
}

int V4l2Capture::open(const std::string& device) {
  close();
  if (const int error = file_.open(device); error != 0) return error;
  v4l2_capability capability{};
  if (const int error = file_.call(VIDIOC_QUERYCAP, &capability); error != 0) return error;
  const bool per_node = (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0;
  const std::uint32_t abilities = per_node ? capability.device_caps : capability.capabilities;
  multi_planar_ = (abilities & V4L2_CAP_VIDEO_CAPTURE) == 0;
  stamps_first_bytes_ = is_stamped_by_first_bytes(capability);
  const bool captures = !multi_planar_ || (abilities & V4L2_CAP_VIDEO_CAPTURE_MPLANE) != 0;
  return captures && (abilities & V4L2_CAP_STREAMING) != 0 ? 0 : ENODEV;
}

void V4l2Capture::close() {
  stream_off();
  file_.close();
}

int V4l2Capture::set_format(GreyFormat format, std::int32_t width, std::int32_t height, RawImage& agreed) {
  int error = EINVAL;
  for (const std::uint32_t fourcc : fourccs(format)) {
    v4l2_format wanted{};
    wanted.type = type();
    const auto fill = [&](auto& pixels) {
      pixels.width = static_cast<std::uint32_t>(width);
      pixels.height = static_cast<std::uint32_t>(height);
      pixels.pixelformat = fourcc;
      pixels.field = V4L2_FIELD_NONE;
    };
    multi_planar_ ? fill(wanted.fmt.pix_mp) : fill(wanted.fmt.pix);
    if (multi_planar_) wanted.fmt.pix_mp.num_planes = 1;
    error = file_.call(VIDIOC_S_FMT, &wanted);
    if (error != 0) continue;
    const auto same = [&](const auto& pixels) {
      return pixels.width == static_cast<std::uint32_t>(width) && pixels.height == static_cast<std::uint32_t>(height) &&
             pixels.pixelformat == fourcc;
    };
    error = EINVAL;
    if (!(multi_planar_ ? same(wanted.fmt.pix_mp) : same(wanted.fmt.pix))) continue;
    const std::int64_t told = multi_planar_ ? wanted.fmt.pix_mp.plane_fmt[0].bytesperline : wanted.fmt.pix.bytesperline;
    agreed = {.format = format,
              .width = width,
              .height = height,
              .stride = told != 0 ? told : row_bytes(format, width),
              .bytes = {}};
    return 0;
  }
  return error;
}

int V4l2Capture::set_period(Duration& period) {
  v4l2_streamparm parameters{};
  parameters.type = type();
  parameters.parm.capture.timeperframe = to_fraction(period);
  const int error = file_.call(VIDIOC_S_PARM, &parameters);
  if (error == 0) period = to_duration(parameters.parm.capture.timeperframe, period);
  return error;
}

int V4l2Capture::map(std::uint32_t index) {
  BufferCall call(type());
  call.buffer.index = index;
  if (const int error = file_.call(VIDIOC_QUERYBUF, &call.buffer); error != 0) return error;
  const std::size_t size = multi_planar_ ? call.planes[0].length : call.buffer.length;
  const off_t offset = multi_planar_ ? call.planes[0].m.mem_offset : call.buffer.m.offset;
  void* const memory = mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_SHARED, file_.get(), offset);
  if (memory == MAP_FAILED) return errno;
  buffers_[index] = {.memory = memory, .size = size};
  count_ = index + 1;
  return 0;
}

int V4l2Capture::stream_on(std::uint32_t buffers) {
  stream_off();
  v4l2_requestbuffers request{};
  request.count = std::min<std::uint32_t>(buffers, kMaxBuffers);
  request.type = type();
  request.memory = V4L2_MEMORY_MMAP;
  int error = file_.call(VIDIOC_REQBUFS, &request);
  const std::uint32_t given = std::min<std::uint32_t>(request.count, kMaxBuffers);  // may be more than asked for
  if (error == 0 && given == 0) error = ENOMEM;
  for (std::uint32_t i = 0; error == 0 && i < given; ++i) error = map(i);
  for (std::uint32_t i = 0; error == 0 && i < given; ++i) error = queue(i);
  std::uint32_t stream = type();
  if (error == 0) error = file_.call(VIDIOC_STREAMON, &stream);
  if (error != 0) stream_off();
  return error;
}

void V4l2Capture::stream_off() {
  if (!file_.is_open()) return;
  std::uint32_t stream = type();
  (void)file_.call(VIDIOC_STREAMOFF, &stream);  // a device that is gone has stopped
  for (std::uint32_t i = 0; i < count_; ++i) munmap(buffers_[i].memory, buffers_[i].size);
  count_ = 0;
  v4l2_requestbuffers none{};
  none.type = type();
  none.memory = V4L2_MEMORY_MMAP;
  (void)file_.call(VIDIOC_REQBUFS, &none);
}

int V4l2Capture::queue(std::uint32_t index) {
  BufferCall call(type());
  call.buffer.index = index;
  return file_.call(VIDIOC_QBUF, &call.buffer);
}

int V4l2Capture::dequeue(V4l2Image& image) {
  BufferCall call(type());
  if (const int error = file_.call(VIDIOC_DQBUF, &call.buffer); error != 0) return error;
  if (call.buffer.index >= count_) return EIO;
  const Buffer& buffer = buffers_[call.buffer.index];
  // In the multi-planar form the image may begin behind a header, which the bytes used include.
  const std::size_t used = multi_planar_ ? call.planes[0].bytesused : call.buffer.bytesused;
  const std::size_t end = std::min(used, buffer.size);
  const std::size_t begin = multi_planar_ ? std::min<std::size_t>(call.planes[0].data_offset, end) : 0;
  constexpr std::int64_t kNsPerUs = 1000;
  image.index = call.buffer.index;
  image.bytes = {static_cast<const std::uint8_t*>(buffer.memory) + begin, end - begin};
  image.t = Time::from_ns(call.buffer.timestamp.tv_sec * kNsPerSecond + call.buffer.timestamp.tv_usec * kNsPerUs);
  image.flags = call.buffer.flags;
  image.sequence = call.buffer.sequence;
  return 0;
}

int find_control(const DeviceFile& file, std::initializer_list<std::uint32_t> ids, V4l2Control& control) {
  for (const std::uint32_t id : ids) {
    v4l2_queryctrl query{};
    query.id = id;
    constexpr std::uint32_t kNever = V4L2_CTRL_FLAG_DISABLED | V4L2_CTRL_FLAG_READ_ONLY;
    if (file.call(VIDIOC_QUERYCTRL, &query) != 0 || (query.flags & kNever) != 0 || query.step <= 0) continue;
    control = {.id = id, .least = query.minimum, .most = query.maximum, .step = query.step};
    return 0;
  }
  return EINVAL;
}

int write_control(const DeviceFile& file, std::uint32_t id, std::int32_t& value) {
  v4l2_control control{};
  control.id = id;
  control.value = value;
  if (const int error = file.call(VIDIOC_S_CTRL, &control); error != 0) return error;
  value = control.value;
  if (file.call(VIDIOC_G_CTRL, &control) == 0) value = control.value;
  return 0;
}

int settle_control(const DeviceFile& file, std::uint32_t id, std::int32_t value) {
  V4l2Control found;
  if (find_control(file, {id}, found) != 0) return 0;
  v4l2_control control{};
  control.id = id;
  if (file.call(VIDIOC_G_CTRL, &control) == 0 && control.value == value) return 0;
  return write_control(file, id, value);
}

int set_sensor_period(const DeviceFile& sensor, Duration& period) {
  v4l2_subdev_frame_interval interval{};
  interval.interval = to_fraction(period);
  const int error = sensor.call(VIDIOC_SUBDEV_S_FRAME_INTERVAL, &interval);
  if (error == 0) period = to_duration(interval.interval, period);
  return error;
}

}  // namespace plumb
