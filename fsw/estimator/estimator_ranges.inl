#pragma once
// What the estimator does with ranges: each is used once, at its own time. The track that starts at the laser's spot
// takes it (ranged feature, after Alberico et al., "Structure-Invariant Range-Visual-Inertial Odometry", 2024), which
// asks nothing of the ground; a range without such a track is compared with the facet under the beam (the paper).
// Included by estimator.cpp alone.

#include <algorithm>

#include "fsw/estimator/estimator.h"
#include "fsw/math/exact.h"

namespace plumb {

inline constexpr double kSpotReach = 0.012;  // of the distance: 5 px, about as far as two tracks keep from each other
inline constexpr double kAidingTimeout_s = 0.5;  // a range that is older says nothing of what is below now

template <class Config>
Status Estimator<Config>::add_range(const RangeSample& sample) {
  ++counters_.ranges;
  if (!options_.range.enabled) return Status::kOk;
  const bool usable = sample.quality == RangeQuality::kValid && sample.range_m >= options_.range.min_range_m &&
                      sample.range_m <= options_.range.max_range_m;
  if (!usable) {
    ++counters_.ranges_invalid;
    return Status::kInvalidValue;
  }
  const Time newest = ranges_.empty() ? last_frame_t_ : std::max(last_frame_t_, ranges_.back().t);
  if (sample.t <= newest && newest != Time::never() && !(ranges_.empty() && sample.t == newest)) {
    ++counters_.ranges_stale;
    return Status::kStale;
  }
  if (ranges_.full()) drop_oldest_range(RangeOutcome::kStale);
  return ranges_.push_back(sample);
}

template <class Config>
MotionPrediction Estimator<Config>::predict_motion(Time stamp) const {
  MotionPrediction out;
  const Time t = state_.calibration().imu_time(stamp);
  if (last_frame_t_ == Time::never() || !imu_.spans(last_frame_t_, t)) return out;
  const Quat dq = gyro_rotation(imu_, initialised_ ? state_.core : CoreState{}, last_frame_t_, t);
  out.valid = true;
  const Quat& q_IC = state_.calibration().sensors().q_IC;
  out.q_CnowCprev = (q_IC.conjugate() * dq.conjugate() * q_IC).normalized();
  if (initialised_ && options_.range.feature && stays(t)) {
    for (const RangeSample& range : ranges_) {
      const std::optional<LaserSpot> spot = laser_spot(range, t);
      if (!spot || (!spot->moves && feature_at(*spot))) continue;
      if (out.wanted.full()) out.wanted.erase(0);
      static_cast<void>(out.wanted.push_back(spot->z));
    }
  }
  return out;
}

/// Where the laser met the ground, seen from the camera at t: the beam at the time of the range, carried to t by the
/// motion between, as the IMU and the present estimate tell it. That is a few centimetres, and an error of the velocity
/// moves it by far less than the range's own noise.
template <class Config>
std::optional<typename Estimator<Config>::LaserSpot> Estimator<Config>::laser_spot(const RangeSample& range,
                                                                                   Time t) const {
  if (standing_ || range.t < state_.t || t < range.t || (t - range.t).seconds() > options_.range.max_age_s)
    return std::nullopt;
  if (!imu_.spans(state_.t, t)) return std::nullopt;
  KinematicState motion = state_.core.motion;
  const auto carry = [&](Time from, Time to) {
    imu_.for_each_interval(from, to, [&](const ImuInterval& i) {
      strapdown_step(motion, state_.core.rates(i.start), state_.core.rates(i.end), i.dt_s, options_.imu.gravity_m_s2);
    });
  };
  carry(state_.t, range.t);
  const SensorCalibration& sensors = state_.calibration().sensors();
  const Vec3 spot_C = sensors.impact_C_m(range.range_m);
  const Quat q_WC_then = motion.q_WI * sensors.q_IC;
  const Vec3 spot_W = motion.p_WI_m + motion.q_WI * (sensors.p_IC_m + sensors.q_IC * spot_C);
  const Vec3 beam_W = motion.q_WI * (sensors.q_IC * sensors.u_C);
  carry(range.t, t);
  const Quat q_CW = (motion.q_WI * sensors.q_IC).conjugate();
  const Vec3 seen_C = q_CW * (spot_W - motion.p_WI_m - motion.q_WI * sensors.p_IC_m);
  const double cos_axis = (q_CW * beam_W).z();
  constexpr double kMinCosine = 0.1;  // a beam across the image says little about depth
  if (!(seen_C.z() > 0.0) || !(cos_axis > kMinCosine)) return std::nullopt;
  const Vec3 axis_C = (q_CW * q_WC_then).conjugate() * Vec3::UnitZ();
  LaserSpot spot{
      seen_C.head<2>() / seen_C.z(), seen_C.z(), cos_axis, {range.range_m, spot_C, axis_C}, spot_W, beam_W, false};
  spot.moves = moves_across(spot, t);
  return spot;
}

/// True when a track at this spot will show some parallax by the time it fills the window: the speed across its ray
/// counts, because straight below a climb nothing moves.
template <class Config>
bool Estimator<Config>::moves_across(const LaserSpot& spot, Time t) const {
  if (!(t > last_frame_t_)) return false;
  const Quat& q_WI = state_.core.motion.q_WI;
  const Vec3 ray_W = q_WI * (state_.calibration().sensors().q_IC * spot.z.homogeneous().normalized());
  const double across_m_s = ray_W.cross(state_.core.motion.v_WI_m_s).norm();
  const double step_s = std::max((t - last_frame_t_).seconds(), options_.vision.pose_interval_s);
  const double window_s = static_cast<double>(Config::kMaxPoses - 1) * step_s;
  return across_m_s * window_s * calibration_.focal_px >= options_.vision.ranged_min_parallax_px * spot.depth_m;
}

/// In hover, in a climb and in a descent the laser stays where it is. A feature there, started with its range, is met
/// by the ranges that follow, and what they differ by is motion along the beam: metric, at any speed, over any ground.
/// The ranges must do what parallax does elsewhere: tell when that first one was a false echo.
template <class Config>
std::optional<typename Estimator<Config>::SpotFeature> Estimator<Config>::feature_at(const LaserSpot& spot) const {
  std::optional<SpotFeature> nearest;
  double limit_m = kSpotReach * spot.ray.range_m;
  for (std::size_t i = 0; i < state_.features.size(); ++i) {
    const SlamFeature& feature = state_.features[i];
    if (!feature.ranged || !(feature.parameters.z() > 0.0)) continue;
    const Vec3 p_W_m = feature_in_world(state_.pose(feature.anchor_slot).camera, feature.parameters);
    const double off_m = (p_W_m - spot.p_W_m).cross(spot.beam_W).norm();
    if (!(off_m < limit_m)) continue;
    limit_m = off_m;
    nearest = SpotFeature{i, off_m};
  }
  return nearest;
}

/// Whether a range that no track took may be spared: the tracks that took theirs have been of use lately, and assume
/// nothing of the ground. The facet is for where there are none: standstill, hover, ground without texture.
template <class Config>
bool Estimator<Config>::tracks_serve(Time t) const {
  if (!options_.range.facet) return true;
  return last_ranged_track_t_ != Time::never() && (t - last_ranged_track_t_).seconds() <= options_.range.facet_after_s;
}

/// Whether tracks or features with a range are about to tell the scale: they have been of use lately, or the filter has
/// just started. Where there is nothing to follow at the laser's spot, only facets between features of the state can.
template <class Config>
bool Estimator<Config>::ranges_tell_scale(Time t) const {
  constexpr double kWait_s = 2.0;
  if (!options_.range.enabled || !options_.range.feature) return false;
  return (t - std::max(last_ranged_track_t_, started_t_)).seconds() <= kWait_s;
}

/// Whether the last ranges are of one surface, to a tenth: where the laser stays, a false echo shows by that.
template <class Config>
bool Estimator<Config>::ranges_agree() const {
  constexpr double kMostApart = 1.1;
  const auto [nearest, farthest] = std::minmax_element(range_depths_m_.begin(), range_depths_m_.end());
  return range_depths_m_.full() && *farthest < kMostApart * *nearest;
}

/// Gives the range to the track that the image at t starts at the laser's spot; an old one nearby may be a corner at an
/// edge. Where the laser stays there may be no room for a new one, and an old one must be as near. One that stands a
/// little off has another depth, by the slope of the ground: that goes into the noise.
template <class Config>
bool Estimator<Config>::give_to_track(const LaserSpot& spot, Time t) {
  constexpr double kNear = 3.0;  // sigmas of an observation
  if (!stays(t) || (!spot.moves && !ranges_agree())) return false;
  double nearest = kNear * options_.vision.pixel_noise_px / calibration_.focal_px;
  typename Table::TrackType* taker = nullptr;
  for (auto& track : tracks_.tracks()) {
    if (!track.alive || track.in_state || track.banned || track.range || track.samples.empty()) continue;
    if (spot.moves && track.age != 1) continue;
    const double off = (track.samples.back().z - spot.z).norm();
    if (!(off < nearest)) continue;
    nearest = off;
    taker = &track;
  }
  if (taker == nullptr) return false;
  const double rho = 1.0 / spot.depth_m;
  const double sigma_m =
      exact::hypot(options_.range.noise_m * spot.cos_axis, options_.range.feature_slope * nearest * spot.depth_m);
  taker->range = TrackRange{taker->samples.back().sequence, rho, sigma_m * rho * rho, !spot.moves, std::nullopt};
  if (state_.estimates_beam()) taker->range->ray = spot.ray;
  report_.range_feature = taker->id;
  return true;
}

template <class Config>
void Estimator<Config>::drop_oldest_range(RangeOutcome outcome) {
  take_range();
  count_range(counters_, outcome);
}

template <class Config>
void Estimator<Config>::drop_ranges_before(Time t, RangeOutcome outcome) {
  while (!ranges_.empty() && ranges_.front().t < t) drop_oldest_range(outcome);
}

template <class Config>
RangeSample Estimator<Config>::take_range() {
  const RangeSample range = ranges_.front();
  ranges_.erase(0);
  const bool silent =
      last_range_sample_t_ == Time::never() || (range.t - last_range_sample_t_).seconds() > kAidingTimeout_s;
  if (silent) range_depths_m_.clear();  // what was below then may be far away by now
  if (range_depths_m_.full()) range_depths_m_.erase(0);
  static_cast<void>(range_depths_m_.push_back(state_.calibration().sensors().impact_C_m(range.range_m).z()));
  last_range_sample_t_ = range.t;
  return range;
}

template <class Config>
Status Estimator<Config>::compare_range(const RangeSample& range, const std::optional<SpotFeature>& feature) {
  {
    StageScope scope(observer_, Stage::kPropagation);
    propagate_to(range.t);
  }
  StageScope scope(observer_, Stage::kRange);
  const Status status =
      feature ? range_.fuse_on_feature(state_, stack_, feature->index, feature->off_m, range.range_m, report_)
              : range_.fuse(state_, stack_, range.range_m, report_);
  const bool used = report_.range_outcome == RangeOutcome::kUsed;
  if (used) last_range_t_ = range.t;
  if (feature) {
    SlamFeature& met = state_.features[feature->index];
    met.ranges_missed = used ? 0 : met.ranges_missed + 1;
    if (used) last_ranged_track_t_ = range.t;
    if (used && met.t_range != Time::never()) met.t_range = range.t;
  }
  return status;
}

template <class Config>
Status Estimator<Config>::fuse_ranges_until(Time t, bool including) {
  while (!ranges_.empty() && (ranges_.front().t < t || (including && ranges_.front().t == t))) {
    const RangeSample range = take_range();  // used once, whatever becomes of it
    report_.range_outcome = RangeOutcome::kStale;
    report_.range_measured_m = range.range_m;
    report_.range_predicted_m = report_.range_sigma_m = 0.0;
    report_.range_facet = {};
    report_.range_feature = 0;
    const bool fresh = range.t >= state_.t && (t - range.t).seconds() <= options_.range.max_age_s;
    const std::optional<LaserSpot> spot = fresh && options_.range.feature ? laser_spot(range, t) : std::nullopt;
    const std::optional<SpotFeature> feature = spot && !spot->moves ? feature_at(*spot) : std::nullopt;
    Status status = Status::kOk;
    if (feature) {
      status = compare_range(range, feature);
    } else if (spot && give_to_track(*spot, t)) {
      report_.range_outcome = RangeOutcome::kFeature;
    } else if (fresh && tracks_serve(range.t)) {
      report_.range_outcome = RangeOutcome::kSpare;
    } else if (fresh) {
      status = compare_range(range, std::nullopt);
    }
    if (!ok(status)) return status;
    count_range(counters_, report_.range_outcome);
  }
  return Status::kOk;
}

}  // namespace plumb
