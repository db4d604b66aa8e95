#pragma once
// The navigation software put together: InputFrames in, navigation state out. Threads, clocks and devices are outside:
// live, the executive calls step() once per tick; in replay, a loop does. Static memory only; a large object (IMU and
// clone history, one waiting image), so it belongs in static storage, not on a stack.

#include <array>
#include <cstdint>

#include "fsw/app/parameters.h"
#include "fsw/base/fixed_vector.h"
#include "fsw/base/mission_config.h"
#include "fsw/base/stage_observer.h"
#include "fsw/base/status.h"
#include "fsw/estimator/estimator.h"
#include "fsw/measurement/input_frame.h"
#include "fsw/predictor/output_predictor.h"
#include "fsw/telemetry/messages.h"
#include "fsw/vision/camera_model.h"
#include "fsw/vision/tracker.h"

namespace plumb {

struct Calibration {
  CameraCalibration camera;
  SensorCalibration sensor;
};

/// What one call of step() did.
struct NavTick {
  Status input_status = Status::kOk;  ///< kOutOfOrder: the tick's time was not after the last one; nothing was used
  bool image_processed = false;       ///< an image went through tracker and estimator; state() and report() are new
  Status image_status = Status::kOk;  ///< of that image: kNotReady while the estimator initialises
  Time t_image;                       ///< of that image
  std::uint32_t image_sequence = 0;
  FixedVector<PredictedState, kMaxImuPerFrame> predicted;  ///< one per IMU sample once there is a state
};

template <class Config>
class NavSystem {
 public:
  using Frame = FeatureFrame<Config::kMaxTracks>;

  /// `tracker` and `observer` (may be null) must outlive this object.
  NavSystem(const Calibration& calibration, const Parameters& parameters, Tracker<Config::kMaxTracks>& tracker,
            StageObserver* observer);

  /// Runs one tick: the samples in total order, then the waiting image if the IMU has reached it, then the new image.
  /// `image` belongs to input.camera and is read only during the call (a frame that has to wait is copied). One frame
  /// waits at a time; a frame that arrives meanwhile is skipped and counted: with an IMU that lags by more than the
  /// frame period every other frame is still used, while replacing the waiting one would starve the filter.
  const NavTick& step(const InputFrame& input, const ImageView* image);

  /// Start from a known state (comparisons only); see Estimator::start_from.
  void start_from(const NavState& truth) { estimator_.start_from(truth); }

  const Estimator<Config>& estimator() const { return estimator_; }
  /// What the tracker saw in the newest processed image, for pictures and logs.
  const Frame& features() const { return features_; }
  const OutputPredictor& predictor() const { return predictor_; }
  const NavSystemCounters& counters() const { return counters_; }
  /// Totals of every part, as of the last tick.
  HealthRecord health() const;

 private:
  void add_samples(const InputFrame& input);
  void add_imu(const ImuSample& sample);
  void accept_image(const InputFrame& input, const ImageView* image);
  void keep_waiting(const CameraFrame& frame);
  void process(const CameraFrame& frame);

  Tracker<Config::kMaxTracks>& tracker_;
  StageObserver* observer_;
  Estimator<Config> estimator_;
  OutputPredictor predictor_;
  Frame features_;
  NavTick tick_;
  Time t_last_tick_ = Time::never();
  std::uint32_t next_image_ = 0;  ///< own count: a camera that restarts begins its own anew
  NavSystemCounters counters_;

  bool waiting_ = false;
  CameraFrame waiting_frame_;  ///< its pixels are in waiting_pixels_
  std::array<std::uint8_t, Config::kMaxImageWidth * Config::kMaxImageHeight> waiting_pixels_{};
};

extern template class NavSystem<PaperConfig>;
extern template class NavSystem<FlightConfig>;
extern template class NavSystem<SelfCalibratingConfig>;

}  // namespace plumb
