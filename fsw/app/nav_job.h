#pragma once
// The half of the navigation software that is allowed to take its time: images and samples in, the estimate at the
// image out. Live it runs in a thread of its own beside the ticks, in a replay within them; it cannot tell the
// difference. Static memory only; a large object (IMU and clone history, one waiting image).

#include <array>
#include <cstdint>

#include "fsw/app/nav_result.h"
#include "fsw/app/parameter_change.h"
#include "fsw/base/mission_config.h"
#include "fsw/base/stage_observer.h"
#include "fsw/base/status.h"
#include "fsw/estimator/estimator.h"
#include "fsw/measurement/input_frame.h"
#include "fsw/vision/camera_model.h"
#include "fsw/vision/tracker.h"

namespace plumb {

struct Calibration {
  CameraCalibration camera;
  SensorCalibration sensor;
};

/// What one step did with images: with the one that waited, or with the one it was given.
struct ImageOutcome {
  bool processed = false;       ///< an image went through tracker and estimator; state and report are new
  bool refused = false;         ///< an image will not be processed: no pixels, stamped ahead, or another was waiting
  Status status = Status::kOk;  ///< of the processed one: kNotReady while the estimator initialises
  Time t;                       ///< of the processed one
  std::uint32_t sequence = 0;
};

template <class Config>
class NavJob {
 public:
  using Frame = FeatureFrame<Config::kMaxTracks>;

  /// `tracker` and `observer` (may be null) must outlive this object.
  NavJob(const Calibration& calibration, const Parameters& parameters, Tracker<Config::kMaxTracks>& tracker,
         StageObserver* observer)
      : parameters_(parameter_table(), parameters),
        tracker_(tracker),
        observer_(observer),
        estimator_(parameters.estimator, calibration.sensor, observer) {}

  /// As OutputStage::check_parameters().
  ParamDamage check_parameters() {
    const ParamDamage damage = parameters_.check();
    use_parameters();
    return damage;
  }
  const ParameterStore& parameters() const { return parameters_; }

  /// The commands, the samples in total order, then the waiting image if the IMU has reached it, then the new image.
  /// `image` belongs to input.camera and is read only during the call (a frame that has to wait is copied). One frame
  /// waits at a time; a frame that arrives meanwhile is skipped and counted: with an IMU that lags by more than the
  /// frame period every other frame is still used, while replacing the waiting one would starve the filter.
  /// Precondition: frames in order of time.
  const ImageOutcome& step(const InputFrame& input, const ImageView* image);

  /// Start from a known state (comparisons only); see Estimator::start_from.
  void start_from(const NavState& truth) { estimator_.start_from(truth); }

  const Estimator<Config>& estimator() const { return estimator_; }
  /// What the tracker saw in the newest processed image, for pictures and logs.
  const Frame& features() const { return features_; }
  /// Of samples and frames; ticks are counted by the caller.
  const NavSystemCounters& counters() const { return counters_; }
  /// The estimate at the image that was processed last.
  NavStateRecord record() const;
  /// The same for the output, with all that is counted.
  NavResult result() const;

 private:
  void obey(const Command& command);
  void use_parameters() {
    estimator_.use(parameters_.active().estimator);
    tracker_.use(parameters_.active().tracker);
  }
  /// How long the state may be relied on without further aiding.
  double reliable_for_s() const {
    const Parameters& parameters = parameters_.active();
    return time_to_unreliable_s(estimator_.state(), drift_model(parameters.estimator.imu), parameters.modes);
  }
  void add_samples(const InputFrame& input);
  void accept_image(const InputFrame& input, const ImageView* image);
  void keep_waiting(const CameraFrame& frame);
  void process(const CameraFrame& frame);
  void refuse(std::uint64_t& counter) {
    ++counter;
    outcome_.refused = true;
  }

  ParameterStore parameters_;
  Tracker<Config::kMaxTracks>& tracker_;
  StageObserver* observer_;
  Estimator<Config> estimator_;
  Frame features_;
  ImageOutcome outcome_;
  Time t_image_;
  std::uint32_t image_sequence_ = 0;
  std::uint32_t next_image_ = 0;  ///< own count: a camera that restarts begins its own anew
  NavSystemCounters counters_;

  bool waiting_ = false;
  CameraFrame waiting_frame_;  ///< its pixels are in waiting_pixels_
  std::array<std::uint8_t, Config::kMaxImageWidth * Config::kMaxImageHeight> waiting_pixels_{};
};

extern template class NavJob<PaperConfig>;
extern template class NavJob<FlightConfig>;
extern template class NavJob<SelfCalibratingConfig>;

}  // namespace plumb
