#include "fsw/estimator/estimator.h"

#include <algorithm>
#include <cmath>

#include "fsw/base/mission_config.h"
#include "fsw/estimator/estimator_ranges.inl"
#include "fsw/estimator/estimator_start.inl"
#include "fsw/estimator/imu_limits.h"

namespace plumb {
namespace {

constexpr double kLongestCoast_s = 8.0;  // without an image; what is left of the state is worth less than a new start
constexpr double kKeptImu = kMaxStartWindow_s + 0.5;  // s of samples behind the horizon, for stillness and starting

}  // namespace

template <class Config>
Estimator<Config>::Estimator(const EstimatorOptions& options, const SensorCalibration& calibration,
                             StageObserver* observer)
    : options_(options),
      calibration_(calibration),
      observer_(observer),
      visual_(options.vision, calibration, options.range.max_features),
      range_(options.range),
      direction_(options.direction),
      image_stillness_(options.start, calibration),
      start_window_(options, calibration) {
  clear_state();
}

template <class Config>
void Estimator<Config>::use(const EstimatorOptions& options) {
  options_ = options;
  visual_.use(options.vision, options.range.max_features);
  range_.use(options.range);
  direction_.use(options.direction);
  image_stillness_.use(options.start);
  start_window_.use(options);
}

template <class Config>
void Estimator<Config>::reset() {
  clear_state();
  tracks_.clear();
  while (!ranges_.empty()) drop_oldest_range(RangeOutcome::kStale);
  visual_.clear();
  range_.clear();
  direction_.clear();
  image_stillness_.clear();
  start_window_.clear();
  initialised_ = false;
  standing_ = false;
  last_kept_t_ = Time::never();
  last_visual_t_ = Time::never();
  last_range_t_ = Time::never();
  last_ranged_track_t_ = Time::never();
  started_t_ = Time::never();
  started_excited_ = false;
  last_range_sample_t_ = Time::never();
  range_depths_m_.clear();
  const std::uint32_t resets = nav_.reset_count + 1;
  nav_ = {};
  nav_.reset_count = resets;
  ++counters_.resets;
}

template <class Config>
Status Estimator<Config>::add_imu(const ImuSample& sample) {
  ++counters_.imu_samples;
  if (!is_within_limits(sample, options_.imu)) {
    ++counters_.imu_invalid;
    return Status::kInvalidValue;
  }
  const Time before = imu_.newest();
  if (initialised_ && imu_.is_exhausted(state_.t)) coast();
  if (!ok(imu_.push(sample))) {
    ++counters_.imu_out_of_order;
    return Status::kOutOfOrder;
  }
  if (before != Time::never() && (sample.t - before).seconds() > options_.imu.max_gap_s) {
    ++counters_.imu_gaps;
    imu_.clear();
    static_cast<void>(imu_.push(sample));
    if (initialised_) {
      reset();
    } else {  // what an attempt to start has gathered ends here too
      image_stillness_.clear();
      start_window_.clear();
    }
  }
  return Status::kOk;
}

template <class Config>
Status Estimator<Config>::process(const Frame& frame) {
  ++counters_.frames;
  report_ = {};
  report_.tracks = static_cast<std::uint32_t>(frame.observations.size());
  const Time t = state_.calibration().imu_time(frame.t);
  if (t <= last_frame_t_ || (initialised_ && t < state_.t)) {
    ++counters_.frames_out_of_order;
    return Status::kOutOfOrder;
  }
  if (initialised_ && (t - last_frame_t_).seconds() > kLongestCoast_s) {
    ++counters_.imu_overflow;
    reset();
  }
  const Time from = initialised_ ? state_.t : t;
  if (!imu_.spans(from, t)) {
    ++counters_.frames_without_imu;
    return Status::kStale;
  }
  const Time window_start = t - Duration::from_seconds(options_.start.still_window_s);
  const ImageEvidence image = image_stillness_.update(frame);
  standing_ = image.still && imu_is_still(imu_, window_start, t, options_);
  max_flow_per_s_ = image.max_flow_per_s;

  Status status = initialised_ ? fuse_image(frame) : start(frame);
  last_frame_t_ = t;
  imu_.drop_before(t - Duration::from_seconds(kKeptImu));
  if (status == Status::kNumericalFault) {
    ++counters_.numerical_faults;
    reset();
  }
  publish(report_.slam_used + report_.msckf_used > 0, t);
  return status;
}

template <class Config>
Status Estimator<Config>::fuse_image(const Frame& frame) {
  const Time t = state_.calibration().imu_time(frame.t);
  tracks_.append(frame);  // first: the tracks at the laser's spots take their ranges
  Status status = fuse_ranges_until(t, false);
  if (!ok(status)) return status;
  {
    StageScope scope(observer_, Stage::kPropagation);
    propagate_to(t);
    make_room_for_clone(t);
    state_.clone_camera(frame.sequence, state_.core.rates(imu_.rates_at(t)).gyro_rad_s);
  }
  const ScaleEvidence scale{started_excited_, ranges_tell_scale(t)};
  status = visual_.run(state_, tracks_, stack_, depth_prior(), scale, report_, observer_);
  if (!ok(status)) return status;
  if (report_.ranged_used > 0) last_range_t_ = last_ranged_track_t_ = t;
  if (!standing_) visual_.follow_noise();  // of an image that repeats the last one, tracks have hardly any
  if (standing_) status = fuse_standing(t);
  if (!ok(status)) return status;
  status = fuse_ranges_until(t, true);
  if (!ok(status)) return status;
  status = fuse_directions(t);
  if (!ok(status)) return status;
  return state_.healthy() ? Status::kOk : Status::kNumericalFault;
}

template <class Config>
void Estimator<Config>::propagate_to(Time t) {
  if (!(state_.t < t)) return;
  CoreTransition transition;
  transition.with_scale = state_.estimates_scale();
  imu_.for_each_interval(state_.t, t, [&](const ImuInterval& interval) {
    propagate_step(state_.core, transition, interval, options_.imu);
  });
  propagate_core(state_.covariance(), transition.phi, transition.q);
  if (transition.with_scale) {
    const ConstMatrixView by_scale(transition.by_scale.data(), kGyroBias, kImuScaleSize, kImuScaleSize);
    add_linear(state_.covariance(), 0, by_scale, ErrorLayout<Config>::kImuScale);
  }
  state_.t = t;
}

// Without images nothing asks for the state, and the samples since the last one fill the buffer. Half of them are used
// then, so that an image that is late is still in time.
template <class Config>
void Estimator<Config>::coast() {
  propagate_to(imu_.oldest() + (imu_.newest() - imu_.oldest()) / 2);
}

template <class Config>
void Estimator<Config>::make_room_for_clone(Time t) {
  const auto& window = state_.window();
  const bool newest_stays = last_frame_t_ == last_kept_t_;
  if (stays(t)) last_kept_t_ = t;
  // While nothing moves, the newest pose is replaced instead of the oldest: the window keeps the baseline it has.
  if ((standing_ || !newest_stays) && window.size() >= 2) {
    const std::uint32_t gone = state_.newest().sequence;
    state_.drop_pose(window.size() - 1);
    for (auto& track : tracks_.tracks()) {
      for (std::size_t i = track.samples.size(); i-- > 0;) {
        if (track.samples[i].sequence == gone) track.forget(i);
      }
    }
  } else if (window.full()) {
    state_.drop_pose(0);
  }
}

template <class Config>
StandingNoise Estimator<Config>::standing_noise() const {
  constexpr double kUnknownDepth = 5.0;  // m, when neither a range nor a feature tells
  constexpr double kAlongAxis = 2.5;     // motion along the optical axis moves the image least: by its mean radius
  const double depth_m = std::max(recent_range_depth_m(), median_depth_m());
  return {kAlongAxis * max_flow_per_s_ * (depth_m > 0.0 ? depth_m : kUnknownDepth), max_flow_per_s_};
}

template <class Config>
Status Estimator<Config>::fuse_standing(Time t) {
  const double step_s = std::max((t - last_frame_t_).seconds(), 1e-3);
  // What one window of images can hide, the images in it hide together: they count as one measurement.
  const double repeats = std::sqrt(std::max(options_.start.still_window_s / step_s, 1.0));
  stack_.begin(state_);
  if (!ok(add_zero_velocity(state_, stack_, standing_noise().velocity_m_s * repeats))) {
    standing_ = false;  // what the filter knows says otherwise: no evidence holds the state
    return Status::kOk;
  }
  report_.zero_velocity = true;
  return stack_.apply(state_);
}

template <class Config>
Status Estimator<Config>::fuse_directions(Time t) {
  const Result<bool> turned = direction_.fuse(state_, stack_, imu_, t, report_, counters_);
  if (!turned) return turned.status();
  if (*turned) range_.clear();  // the facets that it remembers stand in the old world
  return Status::kOk;
}

template <class Config>
DepthPrior Estimator<Config>::depth_prior() const {
  constexpr double kRelativeSigma = 0.5;  // a scene within a factor of two of this depth is well inside two sigma
  const double ranged_m = options_.range.depth_prior ? recent_range_depth_m() : 0.0;
  const double depth_m = ranged_m > 0.0 ? ranged_m : median_depth_m();
  if (depth_m > 0.0) return {1.0 / depth_m, kRelativeSigma / depth_m};
  const double d = options_.vision.min_depth_m;  // semi-infinite: from d_min to infinity within two sigma
  return {1.0 / (2.0 * d), 1.0 / (4.0 * d)};
}

template <class Config>
double Estimator<Config>::recent_range_depth_m() const {
  const bool recent =
      last_range_sample_t_ != Time::never() && (state_.t - last_range_sample_t_).seconds() < kAidingTimeout_s;
  if (!recent) return 0.0;
  const double newest_m = range_depths_m_.back();
  if (!range_depths_m_.full()) return newest_m;
  const double a_m = range_depths_m_[0];
  const double b_m = range_depths_m_[1];
  const double median_m = std::clamp(newest_m, std::min(a_m, b_m), std::max(a_m, b_m));
  constexpr double kFalseEcho = 2.0;  // as far off the median as this, the newest range says nothing of the scene
  return newest_m < kFalseEcho * median_m && median_m < kFalseEcho * newest_m ? newest_m : median_m;
}

template <class Config>
double Estimator<Config>::median_depth_m() const {
  constexpr std::size_t kMinKnown = 5;
  constexpr double kKnown = 0.3;  // sigma of rho over rho
  using Layout = ErrorLayout<Config>;
  const ConstMatrixView p = state_.covariance();
  FixedVector<double, Config::kMaxSlamFeatures> rho;
  for (std::size_t i = 0; i < state_.features.size(); ++i) {
    const double r = state_.features[i].parameters.z();
    const std::size_t at = Layout::feature(i) + 2;
    if (r > 0.0 && p(at, at) < kKnown * kKnown * r * r) static_cast<void>(rho.push_back(r));
  }
  if (rho.size() < kMinKnown) return 0.0;
  std::sort(rho.begin(), rho.end());
  return 1.0 / rho[rho.size() / 2];
}

template <class Config>
void Estimator<Config>::publish(bool visual, Time t) {
  if (visual) last_visual_t_ = t;
  if (!initialised_) return;
  nav_.t = state_.t;
  nav_.valid = true;
  nav_.heading_known = direction_.heading_known();
  nav_.t_vision = standing_ ? t : last_visual_t_;
  nav_.t_range = last_range_t_;
  const KinematicState& m = state_.core.motion;
  Eigen::Map<Vec3>(nav_.p_WI_m.data()) = m.p_WI_m;
  Eigen::Map<Vec3>(nav_.v_WI_m_s.data()) = m.v_WI_m_s;
  nav_.q_WI = {m.q_WI.w(), m.q_WI.x(), m.q_WI.y(), m.q_WI.z()};
  Eigen::Map<Vec3>(nav_.b_gyro_rad_s.data()) = state_.core.b_gyro_rad_s;
  Eigen::Map<Vec3>(nav_.b_accel_m_s2.data()) = state_.core.b_accel_m_s2;
  Eigen::Map<Vec3>(nav_.gyro_scale.data()) = state_.core.gyro_scale;
  Eigen::Map<Vec3>(nav_.accel_scale.data()) = state_.core.accel_scale;
  const ConstMatrixView p = static_cast<const FilterState<Config>&>(state_).covariance();
  Eigen::Map<Mat15>(nav_.covariance.data()) = to_nav_covariance(p, m.q_WI, m.p_WI_m, m.v_WI_m_s);
}

template class Estimator<PaperConfig>;
template class Estimator<FlightConfig>;
template class Estimator<SelfCalibratingConfig>;

}  // namespace plumb
