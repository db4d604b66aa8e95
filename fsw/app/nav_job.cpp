#include "fsw/app/nav_job.h"

#include <algorithm>

#include "fsw/modes/mode_machine.h"

namespace plumb {

template <class Config>
const ImageOutcome& NavJob<Config>::step(const InputFrame& input, const ImageView* image) {
  outcome_ = {};
  for (const Command& command : input.commands) obey(command);
  add_samples(input);
  if (waiting_ && estimator_.imu_reaches(waiting_frame_.t_exposure_mid)) {
    waiting_ = false;
    process(waiting_frame_);
  }
  if (input.has_camera) accept_image(input, image);
  return outcome_;
}

// An image that waits is of the time before, too, and starts the filter as well as any other.
template <class Config>
void NavJob<Config>::obey(const Command& command) {
  if (carry_out(command, parameters_)) use_parameters();
  if (!command.is(CommandId::kReset)) return;
  estimator_.reset();
  tracker_.reset();
  ++counters_.commanded_resets;
}

// Total order within the tick: by time, at equal times the IMU before the range. The record holds each kind in order.
// One wrong stamp far ahead would make all that follow it look late, so it goes no further.
template <class Config>
void NavJob<Config>::add_samples(const InputFrame& input) {
  const auto ahead = [this, &input](Time t) {
    if (t <= input.t) return false;
    ++counters_.samples_ahead;
    return true;
  };
  std::size_t next_range = 0;
  const auto add_next_range = [&] {
    const RangeSample& range = input.range[next_range++];
    if (!ahead(range.t)) static_cast<void>(estimator_.add_range(range));  // a refusal is in the estimator's counters
  };
  for (const ImuSample& sample : input.imu) {
    if (ahead(sample.t)) continue;
    while (next_range < input.range.size() && input.range[next_range].t < sample.t) add_next_range();
    static_cast<void>(estimator_.add_imu(sample));
  }
  while (next_range < input.range.size()) add_next_range();
  for (const DirectionSample& direction : input.direction) {
    if (!ahead(direction.t)) static_cast<void>(estimator_.add_direction(direction));  // likewise
  }
}

template <class Config>
void NavJob<Config>::accept_image(const InputFrame& input, const ImageView* image) {
  const CameraReference& camera = input.camera;
  ++counters_.frames;
  if (input.image_skipped) {
    ++counters_.frames_skipped;
    return;
  }
  if (camera.t_exposure_mid > input.t || image == nullptr || image->pixels == nullptr || image->width <= 0 ||
      image->height <= 0 || image->width > static_cast<std::int32_t>(Config::kMaxImageWidth) ||
      image->height > static_cast<std::int32_t>(Config::kMaxImageHeight) || image->stride < image->width) {
    refuse(counters_.frames_refused);
    return;
  }
  if (waiting_) {
    refuse(counters_.frames_skipped);
    return;
  }
  const CameraFrame frame{.t_exposure_mid = camera.t_exposure_mid, .sequence = camera.sequence, .image = *image};
  if (!outcome_.processed && estimator_.imu_reaches(frame.t_exposure_mid)) {
    process(frame);
  } else {
    keep_waiting(frame);
  }
}

template <class Config>
void NavJob<Config>::keep_waiting(const CameraFrame& frame) {
  const std::int32_t width = frame.image.width;
  for (std::int32_t row = 0; row < frame.image.height; ++row) {
    const std::uint8_t* from = frame.image.pixels + static_cast<std::ptrdiff_t>(row) * frame.image.stride;
    std::copy_n(from, width, waiting_pixels_.data() + static_cast<std::ptrdiff_t>(row) * width);
  }
  waiting_frame_ = frame;
  waiting_frame_.image.pixels = waiting_pixels_.data();
  waiting_frame_.image.stride = width;
  waiting_ = true;
}

template <class Config>
void NavJob<Config>::process(const CameraFrame& frame) {
  const MotionPrediction motion = estimator_.predict_motion(frame.t_exposure_mid);
  Status tracked = Status::kOk;
  {
    const StageScope stage(observer_, Stage::kFrontEnd);
    tracked = tracker_.track(frame, motion, features_);
  }
  if (!ok(tracked)) {
    refuse(counters_.frames_refused);
    return;
  }
  features_.sequence = next_image_++;
  t_image_ = frame.t_exposure_mid;
  image_sequence_ = frame.sequence;
  outcome_.processed = true;
  outcome_.t = t_image_;
  outcome_.sequence = image_sequence_;
  outcome_.status = estimator_.process(features_);
}

template <class Config>
NavStateRecord NavJob<Config>::record() const {
  const NavState& state = estimator_.state();
  return {.state = state,
          .status = {.valid = state.valid,
                     .mode = mode_at_image(state, parameters_.active().modes),
                     .reliable_for_s = reliable_for_s()},
          .report = estimator_.report(),
          .t_image = t_image_,
          .sequence = image_sequence_,
          .state_hash = estimator_.state_hash()};
}

template <class Config>
NavResult NavJob<Config>::result() const {
  return {.state = estimator_.state(),
          .reliable_for_s = reliable_for_s(),
          .report = estimator_.report(),
          .estimator = estimator_.counters(),
          .system = counters_,
          .calibration = estimator_.calibration(),
          .pixel_noise_px = estimator_.pixel_noise_px()};
}

template class NavJob<PaperConfig>;
template class NavJob<FlightConfig>;
template class NavJob<SelfCalibratingConfig>;

}  // namespace plumb
