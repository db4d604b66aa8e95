#pragma once
// The CameraPort with an emulated OV7251 behind it, on a clock of its own that waiting for frames moves on.

#include <cerrno>
#include <cmath>

#include "hal/include/camera_port.h"
#include "test/emulators/ov7251/ov7251_emulator.h"

namespace plumb::emulator {

class Ov7251Port final : public CameraPort {
 public:
  explicit Ov7251Port(Ov7251Emulator& sensor) : sensor_(sensor) {}

  // What a test sets.
  CameraStamp stamp = CameraStamp::kEndOfFrame;
  bool tells_exposure = false;
  bool has_controls = true;
  bool gone = false;
  Duration arrival_delay = Duration::from_us(400);  ///< from the end of a frame, where it is not stamped

  /// The camera was away, and is back with an exposure of its own.
  void lose_exposure(int error) {
    sensor_.write_exposure_lines(kOwnExposure_lines);
    health_.exposures_lost.add(error);
  }

  static constexpr int kOwnExposure_lines = 504;
  Time now() const { return now_; }
  /// The image that was returned last, as the sensor made it.
  const Ov7251Image& image() const { return image_; }

  Result<CameraMode> start(const CameraMode& mode) override {
    if (gone) return Status::kRejected;
    sensor_.set_frame_lines(
        static_cast<int>(std::lround(static_cast<double>(mode.period.ns()) / Ov7251Emulator::kLine_ns)));
    CameraMode taken = mode;
    taken.period = Duration::from_ns(sensor_.period_ns());
    return taken;
  }
  void stop() override {}

  Result<PortFrame> receive(Duration timeout) override {
    const Time end = Time::from_ns(sensor_.next_end_ns());
    if (end > now_ + timeout) {
      now_ = now_ + timeout;
      return gone ? Status::kRejected : Status::kNotReady;
    }
    now_ = end;
    const std::optional<Ov7251Image> image = sensor_.next_image();
    if (gone) return Status::kRejected;
    if (!image) return Status::kNotReady;
    image_ = *image;
    pixels_ = as_grey(image_);
    PortFrame frame{.image = {pixels_.data(), Ov7251Emulator::kWidth, Ov7251Emulator::kHeight, Ov7251Emulator::kWidth},
                    .t = end,
                    .stamp = stamp,
                    .sequence = image_.sequence,
                    .damaged = image_.damaged,
                    .has_exposure = tells_exposure,
                    .exposure = {}};
    if (stamp == CameraStamp::kStartOfExposure) frame.t = Time::from_ns(image_.start_of_exposure_ns);
    if (stamp == CameraStamp::kArrival) frame.t = end + arrival_delay;
    if (stamp == CameraStamp::kEndOfExposure) frame.t = Time::from_ns(image_.end_of_exposure_ns);
    if (tells_exposure) frame.exposure = exposure_of(image_.exposure_lines, image_.gain);
    return frame;
  }

  Result<Exposure> set_exposure(const Exposure& wanted) override {
    if (gone || !has_controls) {
      last_error_ = gone ? ENODEV : ENOTTY;
      return Status::kRejected;
    }
    const double lines = static_cast<double>(wanted.time.ns()) / Ov7251Emulator::kLine_ns;
    return exposure_of(sensor_.write_exposure_lines(static_cast<int>(std::lround(lines))),
                       sensor_.write_gain(static_cast<int>(std::lround(wanted.gain * kGainOne))));
  }
  const CameraHealth& health() const override { return health_; }
  int last_error() const override { return last_error_; }

 private:
  static constexpr double kGainOne = 16.0;
  static Exposure exposure_of(int lines, int gain) {
    return {.time = Duration::from_ns(lines * Ov7251Emulator::kLine_ns), .gain = gain / kGainOne};
  }

  Ov7251Emulator& sensor_;
  Ov7251Image image_;
  std::vector<std::uint8_t> pixels_;
  CameraHealth health_;
  Time now_ = Time::from_ns(0);
  int last_error_ = 0;
};

}  // namespace plumb::emulator
