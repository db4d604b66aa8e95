#include "drivers/ov7251/protocol.h"

#include <algorithm>

#include "fsw/base/assert.h"
#include "fsw/base/hash.h"

namespace plumb::ov7251 {
namespace {

ExposureLimits limits_of(const Options& options, std::int32_t frame_lines) {
  const Duration of_mode = options.line_time * (frame_lines - kUnexposedLines);
  return {.line_time = options.line_time,
          .longest = std::max(std::min(of_mode, options.longest_exposure), options.line_time),
          .max_gain = options.brightness.max_gain};
}

}  // namespace

Protocol::Protocol(const Options& options)
    : options_(options),
      frame_lines_(frame_lines_for(options.period, options.line_time)),
      limits_(limits_of(options, frame_lines_)),
      auto_exposure_(options.brightness, limits_),
      period_(options.line_time * frame_lines_) {
  PLUMB_ASSERT(options.line_time > Duration() && options.period > Duration());
  PLUMB_ASSERT(options.exposure.time > Duration() && options.exposure.gain >= 1.0);
  newest_.exposure = expose(light_s(options.exposure), limits_);
  before_ = newest_;
}

CameraMode Protocol::mode() const {
  // With an external trigger the period is that of the edges, not one of the sensor's.
  const bool external = options_.trigger == CameraTrigger::kExternal;
  return {.width = kWidth,
          .height = kHeight,
          .period = external ? options_.period : options_.line_time * frame_lines_,
          .trigger = options_.trigger};
}

void Protocol::start(Duration period) {
  PLUMB_ASSERT(period > Duration());
  period_ = period;
  has_last_ = false;
  wanted_ = newest_.exposure;
}

Protocol::Brightness Protocol::look_at(const ImageView& image) {
  Hash64 digest;
  std::int64_t sum = 0;
  std::int64_t count = 0;
  bool flat = true;
  for (std::int32_t v = kBrightnessStep_px / 2; v < image.height; v += kBrightnessStep_px) {
    const std::uint8_t* const row = image.pixels + static_cast<std::ptrdiff_t>(v) * image.stride;
    for (std::int32_t u = kBrightnessStep_px / 2; u < image.width; u += kBrightnessStep_px) {
      sum += row[u];
      ++count;
      digest.add(std::uint64_t{row[u]});
      flat = flat && row[u] == image.pixels[(kBrightnessStep_px / 2) * (image.stride + 1)];
    }
  }
  return {.mean = static_cast<double>(sum) / static_cast<double>(count), .digest = digest.value(), .flat = flat};
}

/// When its last row had been read out.
Time Protocol::end_of(const PortFrame& frame) const {
  switch (frame.stamp) {
    case CameraStamp::kStartOfExposure: return frame.t + newest_.exposure.time + options_.line_time * kHeight;
    case CameraStamp::kEndOfFrame: return frame.t;
    case CameraStamp::kArrival: return frame.t - options_.arrival_delay;
    case CameraStamp::kEndOfExposure: return frame.t + options_.line_time * kHeight;
  }
  return frame.t;
}

Exposure Protocol::exposure_of(const PortFrame& frame) const {
  if (frame.has_exposure) return frame.exposure;
  return end_of(frame) > newest_.acts_from ? newest_.exposure : before_.exposure;
}

Time Protocol::middle_of(const PortFrame& frame) const {
  const Duration half = frame_exposure_.time / 2;
  const Duration readout = options_.line_time * kHeight;
  switch (frame.stamp) {
    case CameraStamp::kStartOfExposure: return frame.t + half;
    case CameraStamp::kEndOfFrame: return frame.t - readout - half;
    case CameraStamp::kArrival: return frame.t - options_.arrival_delay - readout - half;
    case CameraStamp::kEndOfExposure: return frame.t - half;
  }
  return frame.t;
}

/// By the sequence where the source counts frames that it lost, and by the time where it does not.
std::uint32_t Protocol::frames_since_last(const PortFrame& frame) const {
  constexpr std::uint32_t kMost = 1U << 30;
  const std::uint32_t step = frame.sequence - last_sequence_;
  const std::uint32_t by_sequence = step == 0 || step > kMost ? 1 : step;  // a source that began anew
  if (frame.stamp == CameraStamp::kArrival) return by_sequence;            // arrivals are late at times
  const std::int64_t half_periods = 2 * (frame.t - last_stamp_).ns() / period_.ns();
  const std::int64_t by_time = std::clamp<std::int64_t>((half_periods + 1) / 2, 1, kMost);
  return std::max(by_sequence, static_cast<std::uint32_t>(by_time));
}

Result<CameraFrame> Protocol::on_frame(const PortFrame& frame) {
  if (frame.image.width != kWidth || frame.image.height != kHeight) {
    counters_.wrong_size.add(value_pair(frame.image.width, frame.image.height));
    return Status::kRejected;
  }
  frame_exposure_ = exposure_of(frame);
  const Time middle = middle_of(frame);
  if (has_last_ && (frame.t <= last_stamp_ || middle <= last_middle_)) {
    counters_.out_of_order.add(frame.sequence);
    return Status::kOutOfOrder;
  }
  const std::uint32_t step = has_last_ ? frames_since_last(frame) : 1;
  if (step > 1) counters_.lost.add(step - 1, step - 1);
  sequence_ = has_last_ ? sequence_ + step : frame.sequence;
  last_stamp_ = frame.t;
  last_end_ = end_of(frame);
  last_middle_ = middle;
  last_sequence_ = frame.sequence;
  const bool has_last_image = has_last_;
  has_last_ = true;
  if (frame.damaged) {
    counters_.damaged.add(frame.sequence);
    return Status::kRejected;
  }
  const Brightness brightness = look_at(frame.image);
  const bool repeated = has_last_image && !brightness.flat && brightness.digest == last_digest_;
  last_digest_ = brightness.digest;
  if (repeated) {
    counters_.repeated.add(frame.sequence);
    return Status::kRejected;
  }
  adjust(brightness.mean, last_end_);
  if (frame.stamp == CameraStamp::kArrival) ++counters_.unstamped;
  ++counters_.frames;
  return CameraFrame{.t_exposure_mid = middle, .sequence = sequence_, .image = frame.image};
}

void Protocol::adjust(double mean, Time end) {
  if (refused_.time > Duration()) wanted_ = refused_;
  refused_ = {};
  // An image says what exposure is right only when it is known which one it had.
  if (!options_.auto_exposure || end <= newest_.acts_from) return;
  const Exposure next = auto_exposure_.update(mean, newest_.exposure);
  // What led to the present one leads there again: the camera has no steps or limits that come nearer.
  if (next != newest_.exposure && next != asked_) wanted_ = next;
}

void Protocol::on_exposure_set(const Exposure& taken, Time now) {
  asked_ = wanted_;
  wanted_ = {};
  if (counters_.exposures > 0 && taken == newest_.exposure) return;
  // Counted from the frame that had ended last, which the caller may have taken some time ago; the half is for jitter.
  const std::int64_t ended = has_last_ ? std::max<std::int64_t>((now - last_end_).ns() / period_.ns(), 0) : 0;
  const Time last_end = has_last_ ? last_end_ + period_ * ended : now;
  before_ = newest_;
  newest_ = {.exposure = taken, .acts_from = last_end + period_ * kExposureDelay_frames + period_ / 2};
  ++counters_.exposures;
}

void Protocol::on_exposure_refused(int error) {
  counters_.refused.add(error);
  refused_ = wanted_.time > Duration() ? wanted_ : newest_.exposure;
  wanted_ = {};
}

}  // namespace plumb::ov7251
