#pragma once
// Frames of an OV7251 become camera frames stamped at the middle of their exposure, and their brightness becomes the
// exposure of the frames to come. It knows no camera and no clock; device.h joins it to both.
//
// The shutter is global: all rows are exposed together and then read out. So the middle of the exposure lies half the
// exposure, and where the stamp is that of the end also the readout, from the stamp. The exposure is that of the very
// frame, which the source tells or which is known from what was asked for and when.

#include <array>
#include <cstdint>

#include "drivers/ov7251/auto_exposure.h"
#include "fsw/base/fault_counter.h"
#include "fsw/base/fixed_vector.h"
#include "fsw/base/status.h"
#include "fsw/measurement/samples.h"

namespace plumb::ov7251 {

struct Options {
  Duration period = Duration::from_ns(33'333'333);  ///< the sensor's nearest mode is taken
  CameraTrigger trigger = CameraTrigger::kFreeRun;
  Duration line_time = kLineTime;
  bool auto_exposure = true;
  Exposure exposure{.time = Duration::from_us(5'000), .gain = 1.0};  ///< the first, or the only one
  Duration longest_exposure = Duration::from_us(10'000);             ///< see exposure_for_blur()
  AutoExposureOptions brightness{};
  /// From the end of a frame to its arrival, for sources that do not stamp their frames.
  Duration arrival_delay{};
};

/// Frames that still end with the exposure before, after another was set: one is being made, and the registers act on
/// the next or the one after it.
inline constexpr std::int64_t kExposureDelay_frames = 2;
/// Brightness is sampled at every so many pixels of a row and of a column.
inline constexpr std::int32_t kBrightnessStep_px = 8;

/// What values mean, kCameraFaults tells (fsw/events/device_faults.h).
struct Counters {
  std::uint32_t frames = 0;   ///< passed on
  FaultCounter lost;          ///< frames of the sensor that did not come, by the time or by the sequence
  FaultCounter damaged;       ///< the source says that the image is not whole
  FaultCounter wrong_size;    ///< images of another size than the sensor's
  FaultCounter out_of_order;  ///< stamped at or before the frame before
  /// Images equal to the one before in every pixel that was looked at, although not black or white all over: noise
  /// makes that impossible, so the sensor or the link repeats itself.
  FaultCounter repeated;
  std::uint32_t unstamped = 0;  ///< passed on with the time of arrival, less `arrival_delay`, for want of a stamp
  std::uint32_t exposures = 0;  ///< changes of exposure that the camera took
  FaultCounter refused;         ///< times that it did not take a change, or came back without the exposure it had
};

class Protocol {
 public:
  /// Precondition: options within their limits, exposure and period above zero.
  explicit Protocol(const Options& options);

  /// The mode to ask the camera for.
  CameraMode mode() const;
  /// The camera streams with this period; the next frame is the first.
  void start(Duration period);

  /// The camera frame of what came. kRejected: no image to be used, counted as the reason. kOutOfOrder: as counted.
  Result<CameraFrame> on_frame(const PortFrame& frame);
  /// The exposure that the last frame was made with, as far as is known.
  const Exposure& exposure() const { return frame_exposure_; }

  /// The exposure to ask the camera for; without time: none.
  const Exposure& wanted() const { return wanted_; }
  /// The camera took this exposure at `now`.
  void on_exposure_set(const Exposure& taken, Time now);
  /// It took none, or came back without the one it had, for this reason of the system (errno). It is asked for again
  /// after the next frame.
  void on_exposure_refused(int error);

  bool at_exposure_limit() const { return auto_exposure_.at_limit(); }
  const Counters& counters() const { return counters_; }

 private:
  struct Setting {
    Exposure exposure;
    Time acts_from = Time::never();  ///< on frames that end after this
  };
  struct Brightness {
    double mean = 0.0;
    std::uint64_t digest = 0;  ///< of the pixels looked at
    bool flat = true;          ///< all of them equal
  };

  static Brightness look_at(const ImageView& image);
  Time end_of(const PortFrame& frame) const;
  Exposure exposure_of(const PortFrame& frame) const;
  Time middle_of(const PortFrame& frame) const;
  std::uint32_t frames_since_last(const PortFrame& frame) const;
  void adjust(double mean, Time end);

  Options options_;
  std::int32_t frame_lines_;
  ExposureLimits limits_;
  AutoExposure auto_exposure_;
  Duration period_;
  // The newest setting, and the one before, which frames on their way still have.
  Setting newest_;
  Setting before_;
  Exposure wanted_;
  Exposure refused_;
  Exposure asked_;  ///< what newest_ was taken for
  Exposure frame_exposure_;
  bool has_last_ = false;
  Time last_stamp_;
  Time last_end_;
  Time last_middle_;
  std::uint32_t last_sequence_ = 0;  ///< of the source
  std::uint32_t sequence_ = 0;       ///< of the sensor's frames, lost ones included
  std::uint64_t last_digest_ = 0;
  Counters counters_;
};

}  // namespace plumb::ov7251
