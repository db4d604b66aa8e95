#pragma once
// The estimator as the rest of Plumb sees it: samples and feature frames in, navigation state out.
// Everything is a function of the sequence of calls; nothing here allocates, waits or reads a clock.

#include <cstdint>

#include "fsw/base/stage_observer.h"
#include "fsw/base/status.h"
#include "fsw/estimator/options.h"
#include "fsw/estimator/report.h"
#include "fsw/measurement/nav_state.h"
#include "fsw/measurement/samples.h"
#include "fsw/vision/feature_frame.h"
#include "fsw/vision/tracker.h"

namespace plumb {

template <class Config>
class Estimator {
 public:
  using Frame = FeatureFrame<Config::kMaxTracks>;

  Estimator(const EstimatorOptions& options, const SensorCalibration& calibration, StageObserver* observer = nullptr);

  /// Back to "initialising". Counters stay; reset_count goes up by one.
  void reset();

  /// Buffers one sample. kOutOfOrder, kInvalidValue, kFull: counted and dropped.
  Status add_imu(const ImuSample& sample);
  /// Buffers one range; it is used once, at its own time, by the next process() that reaches it.
  Status add_range(const RangeSample& sample);

  /// True when the buffered IMU reaches t, so that process() at t can integrate exactly to it.
  bool imu_reaches(Time t) const;
  /// Camera rotation from the last processed image to t, from the gyro and the bias estimate.
  MotionPrediction predict_motion(Time t) const;

  /// Fuses everything up to the image time and then the image. kNotReady while initialising (state().valid is false).
  Status process(const Frame& frame);

  /// Start from a known state (comparisons only): position, velocity, attitude and biases of `truth` at truth.t, taken
  /// at the next image at or after that time.
  void start_from(const NavState& truth);

  /// The state at the newest processed image.
  const NavState& state() const;
  const FrameReport& report() const;
  const EstimatorCounters& counters() const;
  /// 64-bit hash over the nominal state and the whole covariance, every bit of them.
  std::uint64_t state_hash() const;
};

}  // namespace plumb
