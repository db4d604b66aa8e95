#include "fsw/app/nav_system.h"

#include <algorithm>

namespace plumb {

template <class Config>
NavSystem<Config>::NavSystem(const Calibration& calibration, const Parameters& parameters,
                             Tracker<Config::kMaxTracks>& tracker, StageObserver* observer)
    : tracker_(tracker),
      observer_(observer),
      estimator_(parameters.estimator, calibration.sensor, observer),
      predictor_(
          {.gravity_m_s2 = parameters.estimator.imu.gravity_m_s2, .max_gap_s = parameters.estimator.imu.max_gap_s}) {}

template <class Config>
const NavTick& NavSystem<Config>::step(const InputFrame& input, const ImageView* image) {
  tick_.input_status = Status::kOk;
  tick_.image_processed = false;
  tick_.image_status = Status::kOk;
  tick_.predicted.clear();
  ++counters_.ticks;
  if (input.t <= t_last_tick_) {
    ++counters_.ticks_out_of_order;
    tick_.input_status = Status::kOutOfOrder;
    return tick_;
  }
  t_last_tick_ = input.t;
  add_samples(input);
  if (waiting_ && estimator_.imu_reaches(waiting_frame_.t_exposure_mid)) {
    waiting_ = false;
    process(waiting_frame_);
  }
  if (input.has_camera) accept_image(input, image);
  return tick_;
}

// Total order within the tick: by time, at equal times the IMU before the range. The record holds each kind in order.
// One wrong stamp far ahead would make all that follow it look late, so it goes no further.
template <class Config>
void NavSystem<Config>::add_samples(const InputFrame& input) {
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
    add_imu(sample);
  }
  while (next_range < input.range.size()) add_next_range();
  for (const DirectionSample& direction : input.direction) {
    if (!ahead(direction.t)) static_cast<void>(estimator_.add_direction(direction));  // likewise
  }
}

template <class Config>
void NavSystem<Config>::add_imu(const ImuSample& sample) {
  // The estimator judges the sample for both. A full buffer is its own trouble: the output goes on.
  const Status status = estimator_.add_imu(sample);
  if (!ok(status) && status != Status::kFull) return;
  if (!ok(predictor_.add_imu(sample))) return;
  const NavState& now = predictor_.state();
  if (!now.valid) return;
  const Status kept =
      tick_.predicted.push_back({.t = now.t, .p_WI_m = now.p_WI_m, .v_WI_m_s = now.v_WI_m_s, .q_WI = now.q_WI});
  PLUMB_ASSERT(ok(kept));  // one per IMU sample of the tick: both have the same capacity
}

template <class Config>
void NavSystem<Config>::accept_image(const InputFrame& input, const ImageView* image) {
  const CameraReference& camera = input.camera;
  ++counters_.frames;
  if (camera.t_exposure_mid > input.t || image == nullptr || image->pixels == nullptr || image->width <= 0 ||
      image->height <= 0 || image->width > static_cast<std::int32_t>(Config::kMaxImageWidth) ||
      image->height > static_cast<std::int32_t>(Config::kMaxImageHeight) || image->stride < image->width) {
    ++counters_.frames_refused;
    return;
  }
  if (waiting_) {
    ++counters_.frames_skipped;
    return;
  }
  const CameraFrame frame{.t_exposure_mid = camera.t_exposure_mid, .sequence = camera.sequence, .image = *image};
  if (!tick_.image_processed && estimator_.imu_reaches(frame.t_exposure_mid)) {
    process(frame);
  } else {
    keep_waiting(frame);
  }
}

template <class Config>
void NavSystem<Config>::keep_waiting(const CameraFrame& frame) {
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
void NavSystem<Config>::process(const CameraFrame& frame) {
  const MotionPrediction motion = estimator_.predict_motion(frame.t_exposure_mid);
  Status tracked = Status::kOk;
  {
    const StageScope stage(observer_, Stage::kFrontEnd);
    tracked = tracker_.track(frame, motion, features_);
  }
  if (!ok(tracked)) {
    ++counters_.frames_refused;
    return;
  }
  features_.sequence = next_image_++;
  tick_.image_processed = true;
  tick_.t_image = frame.t_exposure_mid;
  tick_.image_sequence = frame.sequence;
  tick_.image_status = estimator_.process(features_);
  // Refused corrections are in the predictor's counters; its output then simply goes on.
  static_cast<void>(predictor_.correct(estimator_.state()));
}

template <class Config>
HealthRecord NavSystem<Config>::health() const {
  return {.t = t_last_tick_,
          .estimator = estimator_.counters(),
          .system = counters_,
          .predictor = predictor_.counters(),
          .tracking = predictor_.tracking(),
          .calibration = estimator_.calibration(),
          .pixel_noise_px = estimator_.pixel_noise_px()};
}

template class NavSystem<PaperConfig>;
template class NavSystem<FlightConfig>;
template class NavSystem<SelfCalibratingConfig>;

}  // namespace plumb
