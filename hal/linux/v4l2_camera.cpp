#include "hal/linux/v4l2_camera.h"

#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>

#include "hal/linux/bounded_receive.h"
#include "hal/linux/monotonic_clock.h"

namespace plumb {
namespace {

constexpr std::array kFormats = {GreyFormat::kGrey, GreyFormat::kY10, GreyFormat::kY10Packed};
// Frames that may be looked through in one call for one that is well formed.
constexpr int kMaxFramesPerCall = 16;

// Source: Linux, Documentation/userspace-api/media/v4l/ext-ctrls-camera.rst.
constexpr Duration kAbsoluteExposureStep = Duration::from_us(100);

// The largest value that the control has up to this one, else its least.
std::int32_t to_step(const V4l2Control& control, double value) {
  constexpr double kRounding = 1e-6;  // of a step: a value that is one is not to fall short of it
  const double bounded = std::clamp<double>(value, control.least, control.most);
  return control.least +
         control.step * static_cast<std::int32_t>(std::floor((bounded - control.least) / control.step + kRounding));
}

std::int32_t to_nearest_step(const V4l2Control& control, double value) {
  return to_step(control, value + 0.5 * control.step);
}

}  // namespace

std::unique_ptr<V4l2Camera> V4l2Camera::open(const V4l2CameraOptions& options, std::string& error) {
  std::unique_ptr<V4l2Camera> camera(new V4l2Camera(options));
  const int reason = camera->connect();
  if (reason == 0) return camera;
  const bool is_sensor = camera->capture_.file().is_open() && !options.sensor.empty() && !camera->sensor_.is_open();
  error = (is_sensor ? options.sensor : options.device) + ": cannot be opened as a camera: " + std::strerror(reason);
  return nullptr;
}

int V4l2Camera::connect() {
  if (const int error = capture_.open(options_.device); error != 0) return error;
  return options_.sensor.empty() ? 0 : sensor_.open(options_.sensor);
}

/// Sets everything up in this order, because format and interval each put exposure and gain back.
int V4l2Camera::configure(GreyFormat format) {
  if (const int error = capture_.set_format(format, mode_.width, mode_.height, agreed_); error != 0) return error;
  // A device that cannot set the interval has one of its own.
  (void)(sensor_.is_open() ? set_sensor_period(sensor_, mode_.period) : capture_.set_period(mode_.period));
  const bool external = mode_.trigger == CameraTrigger::kExternal;
  if (external && options_.trigger_control == 0) return EINVAL;
  std::int32_t trigger = external ? 1 : 0;
  if (options_.trigger_control != 0) {
    if (const int error = write_control(controls(), options_.trigger_control, trigger); error != 0) return error;
  }
  // A camera that does not take it is of use all the same.
  if (exposure_.time > Duration() && !apply(exposure_)) stream_.on_exposure_lost(last_error_);
  return capture_.stream_on(kBuffers);
}

int V4l2Camera::begin() {
  int error = EINVAL;
  for (const GreyFormat format : kFormats) {
    error = configure(format);
    // EPIPE: the sensor's end of the pipeline delivers another format.
    if (error != EINVAL && error != EPIPE) break;
  }
  streaming_ = error == 0;
  return error;
}

Result<CameraMode> V4l2Camera::start(const CameraMode& mode) {
  stop();
  if (mode.width <= 0 || mode.height <= 0 || mode.period <= Duration()) return Status::kInvalidValue;
  mode_ = mode;
  wanted_ = true;
  stream_.start();
  int error = capture_.file().is_open() ? 0 : connect();
  if (error == 0) error = begin();
  if (error == 0) return mode_;
  go_away(error);
  if (error != EINVAL && error != EPIPE) return Status::kRejected;
  wanted_ = false;
  return Status::kInvalidValue;
}

void V4l2Camera::stop() {
  wanted_ = false;
  streaming_ = false;
  lent_ = -1;
  capture_.stream_off();
}

void V4l2Camera::go_away(int error) {
  last_error_ = error;
  streaming_ = false;
  lent_ = -1;
  capture_.close();
  sensor_.close();
  next_reopen_ = clock_now() + kReopenPeriod;
}

bool V4l2Camera::come_back() {
  if (streaming_) return true;
  if (clock_now() < next_reopen_) return false;
  int error = connect();
  if (error == 0) error = begin();
  if (error != 0) {
    go_away(error);
    return false;
  }
  stream_.restart();
  return true;
}

/// Gives the lent buffer back first. kInvalidValue: what was taken is no image of the mode; look again.
Result<PortFrame> V4l2Camera::take() {
  if (lent_ >= 0) {
    const int error = capture_.queue(static_cast<std::uint32_t>(lent_));
    lent_ = -1;
    if (error != 0) {
      go_away(error);
      return Status::kRejected;
    }
  }
  V4l2Image taken;
  const int error = capture_.dequeue(taken);
  if (error == EAGAIN) return Status::kNotReady;
  if (error != 0) {
    go_away(error);
    return Status::kRejected;
  }
  const Time now = clock_now();
  lent_ = static_cast<int>(taken.index);
  RawImage raw = agreed_;
  raw.bytes = taken.bytes;
  const Result<ImageView> image = to_grey(raw, unpacked_);
  if (!image) {
    stream_.on_malformed(taken.bytes.size());
    return Status::kInvalidValue;
  }
  PortFrame frame{.image = *image,
                  .t = taken.t,
                  .stamp = stamp_of(taken.flags),
                  .sequence = taken.sequence,
                  .damaged = (taken.flags & V4L2_BUF_FLAG_ERROR) != 0,
                  .has_exposure = false,
                  .exposure = {}};
  const bool monotonic = (taken.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  stream_.on_frame(frame, monotonic, now);
  return frame;
}

Result<PortFrame> V4l2Camera::receive(Duration timeout) {
  if (!wanted_) return Status::kOutOfOrder;
  return receive_within(
      {.timeout = timeout, .reopen_period = kReopenPeriod, .most_looks = kMaxFramesPerCall},
      [this] { return come_back(); }, [this] { return take(); }, [this] { return capture_.file().get(); });
}

CameraStamp V4l2Camera::stamp_of(std::uint32_t flags) const {
  if (capture_.stamps_first_bytes()) return CameraStamp::kEndOfExposure;
  return (flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_SOE ? CameraStamp::kStartOfExposure
                                                                                 : CameraStamp::kEndOfFrame;
}

/// Switches what the camera does by itself off, which else keeps these controls from being written, but only where it
/// has both.
int V4l2Camera::find_exposure_controls(V4l2Control& time, V4l2Control& gain) const {
  int error = find_control(controls(), {V4L2_CID_EXPOSURE, V4L2_CID_EXPOSURE_ABSOLUTE}, time);
  if (error == 0) error = find_control(controls(), {V4L2_CID_GAIN, V4L2_CID_ANALOGUE_GAIN}, gain);
  if (error == 0) error = settle_control(controls(), V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL);
  if (error == 0) error = settle_control(controls(), V4L2_CID_AUTOGAIN, 0);
  return error;
}

Result<Exposure> V4l2Camera::apply(const Exposure& wanted) {
  V4l2Control time;
  V4l2Control gain;
  int error = find_exposure_controls(time, gain);
  // The limits of the control hold for the mode that is set; a longer exposure would stretch the frame.
  const Duration step = time.id == V4L2_CID_EXPOSURE_ABSOLUTE ? kAbsoluteExposureStep : options_.exposure_step;
  // A step is coarse against a short exposure: what is cut off the time goes into the gain.
  std::int32_t steps = to_step(time, wanted.time.seconds() / step.seconds());
  const double light_s = wanted.time.seconds() * wanted.gain;
  const double gain_for_time = steps > 0 ? light_s / (step * steps).seconds() : wanted.gain;
  std::int32_t sixteenths = to_nearest_step(gain, gain_for_time / options_.gain_step);
  // The gain first: whatever fails then leaves the exposure as it was, which time stamps depend on. The gain alone only
  // makes the image brighter or darker, and the next exposure that is asked for sets it again.
  if (error == 0) error = write_control(controls(), gain.id, sixteenths);
  if (error == 0) error = write_control(controls(), time.id, steps);
  if (error == 0) return Exposure{.time = step * steps, .gain = sixteenths * options_.gain_step};
  last_error_ = error;
  return Status::kRejected;
}

Result<Exposure> V4l2Camera::set_exposure(const Exposure& wanted) {
  if (!can_be_asked_for(wanted)) return Status::kInvalidValue;
  exposure_ = wanted;
  if (!capture_.file().is_open()) return Status::kRejected;
  return apply(wanted);
}

}  // namespace plumb
