#pragma once
// Starting in motion, the part that remembers: the newest images, the problem posed to MotionStart from them,
// and the decision whether its answer can be believed yet.

#include <algorithm>

#include "fsw/estimator/motion_start.h"
#include "fsw/vision/feature_frame.h"

namespace plumb {

/// Ranges that wait to be fused, in order of time.
inline constexpr std::size_t kMaxPendingRanges = 64;
using PendingRanges = FixedVector<RangeSample, kMaxPendingRanges>;

template <std::size_t MaxTracks>
class StartWindow {
 public:
  static constexpr std::size_t kMaxFrames = 48;  ///< 1.5 s at 30 Hz
  using Frame = FeatureFrame<MaxTracks>;
  using Frames = FixedVector<Frame, kMaxFrames>;

  StartWindow(const EstimatorOptions& options, const SensorCalibration& calibration)
      : options_(options), motion_start_(options, calibration) {}
  /// Other options from the next image on.
  void use(const EstimatorOptions& options) {
    options_ = options;
    motion_start_.use(options);
  }

  void clear() { frames_.clear(); }
  /// The images of the window, oldest first; a solution holds at the first.
  const Frames& frames() const { return frames_; }
  /// Whether the acceleration in the window, as the last try found it, told the scale.
  bool excited() const { return excited_; }

  /// Takes one more image in and tries to start from all that are there. kNotReady: wait for the next image.
  Result<StartSolution> try_start(const Frame& frame, const ImuBuffer& imu, const PendingRanges& ranges);

 private:
  static constexpr std::size_t kMinRanges = 3;
  /// What the IMU says of the whole window is taken for exact, so it must have missed hardly anything.
  static constexpr Duration kLongestGap = Duration::from_ms(50);
  /// Without ranges: at constant velocity the fit's own sigma cannot be believed.
  static constexpr double kMinExcitation_m_s2 = 0.3;

  void pose_problem(const PendingRanges& ranges);
  void add_features(const FixedVector<std::size_t, kMaxStartImages>& chosen);
  StartFeature history(std::uint32_t track_id, const FixedVector<std::size_t, kMaxStartImages>& chosen) const;
  /// Whether velocity, and with it scale, can be believed. `waited`: the window will not grow any longer.
  bool scale_is_known(const StartSolution& solution, bool waited) const;
  /// How much the acceleration changes over the window, m/s^2: what scale can be told from without ranges. Taken from
  /// averages between images, which are blind to vibration.
  double excitation_m_s2(const ImuBuffer& imu) const;

  EstimatorOptions options_;
  MotionStart motion_start_;
  StartProblem problem_;
  Frames frames_;
  bool excited_ = false;
};

template <std::size_t MaxTracks>
Result<StartSolution> StartWindow<MaxTracks>::try_start(const Frame& frame, const ImuBuffer& imu,
                                                        const PendingRanges& ranges) {
  const Duration longest = Duration::from_seconds(options_.start.motion_window_max_s);
  const Time unbroken = imu.unbroken_since(frame.t, kLongestGap);
  bool waited = false;  // for as long as the window can grow
  while (!frames_.empty() &&
         (frames_.full() || frame.t - frames_.front().t > longest || frames_.front().t < unbroken)) {
    frames_.erase(0);
    waited = true;
  }
  if (!(unbroken <= frame.t)) return Status::kNotReady;
  static_cast<void>(frames_.push_back(frame));
  const double span_s = (frame.t - frames_.front().t).seconds();
  if (span_s < options_.start.motion_window_s || frames_.size() < 3) return Status::kNotReady;

  pose_problem(ranges);
  excited_ = excitation_m_s2(imu) > kMinExcitation_m_s2;
  if (!excited_ && problem_.ranges.size() < kMinRanges) return Status::kNotReady;
  const Result<StartSolution> solution = motion_start_.solve(problem_, imu);
  if (!solution) return Status::kNotReady;
  waited = waited || frames_.full() || span_s > 0.9 * options_.start.motion_window_max_s;
  if (!scale_is_known(*solution, waited)) return Status::kNotReady;
  return solution;
}

template <std::size_t MaxTracks>
bool StartWindow<MaxTracks>::scale_is_known(const StartSolution& solution, bool waited) const {
  constexpr double kKnownVelocity = 0.15;      // of the speed, 1 sigma: below it there is no point in waiting
  constexpr double kKnownSlowVelocity = 0.05;  // m/s
  const double speed = solution.core.motion.v_WI_m_s.norm();
  const bool precise = solution.velocity_sigma_m_s < std::max(kKnownVelocity * speed, kKnownSlowVelocity);
  const std::size_t fitting = solution.ranges_fitting();
  const bool ranged = fitting >= kMinRanges && 2 * fitting > problem_.ranges.size();
  // Ranges give the scale at any velocity; with them a long window may start with the uncertainty it has.
  return ranged ? precise || waited : precise && excited_;
}

template <std::size_t MaxTracks>
double StartWindow<MaxTracks>::excitation_m_s2(const ImuBuffer& imu) const {
  KinematicState s;  // from rest and without gravity: the specific force, integrated in the frame of the first image
  Vec3 sum = Vec3::Zero();
  double squares = 0.0;
  for (std::size_t i = 0; i + 1 < problem_.images.size(); ++i) {
    const Vec3 before = s.v_WI_m_s;
    const Time from = problem_.images[i];
    const Time to = problem_.images[i + 1];
    imu.for_each_interval(from, to,
                          [&s](const ImuInterval& step) { strapdown_step(s, step.start, step.end, step.dt_s, 0.0); });
    const Vec3 mean = (s.v_WI_m_s - before) / (to - from).seconds();
    sum += mean;
    squares += mean.squaredNorm();
  }
  const auto count = static_cast<double>(problem_.images.size() - 1);
  return std::sqrt(std::max(squares / count - (sum / count).squaredNorm(), 0.0));
}

template <std::size_t MaxTracks>
void StartWindow<MaxTracks>::pose_problem(const PendingRanges& ranges) {
  problem_.images.clear();
  problem_.features.clear();
  problem_.ranges.clear();
  const std::size_t images = std::min(frames_.size(), kMaxStartImages);
  FixedVector<std::size_t, kMaxStartImages> chosen;
  for (std::size_t i = 0; i < images; ++i) {  // evenly spread, the first and the last among them
    static_cast<void>(chosen.push_back(i * (frames_.size() - 1) / (images - 1)));
    static_cast<void>(problem_.images.push_back(frames_[chosen.back()].t));
  }
  add_features(chosen);
  for (const RangeSample& range : ranges) {
    if (range.t < problem_.images.front() || range.t > problem_.images.back()) continue;
    if (!ok(problem_.ranges.push_back({range.t, range.range_m}))) break;
  }
}

template <std::size_t MaxTracks>
void StartWindow<MaxTracks>::add_features(const FixedVector<std::size_t, kMaxStartImages>& chosen) {
  // Every k-th of the tracks that reach far enough back: in order of birth alone, the oldest would all sit at the image
  // edge they are about to leave by.
  constexpr std::size_t kMinEarlier = 3;
  const auto& now = frames_.back().observations;
  std::size_t usable = 0;
  for (const FeatureObservation& o : now) usable += history(o.track_id, chosen).earlier.size() >= kMinEarlier ? 1 : 0;
  const std::size_t wanted = std::min(usable, kMaxStartFeatures);
  std::size_t rank = 0;
  for (const FeatureObservation& o : now) {
    StartFeature feature = history(o.track_id, chosen);
    if (feature.earlier.size() < kMinEarlier) continue;
    feature.anchor_z = Vec2(o.x, o.y);
    const bool take = rank * wanted / usable != (rank + 1) * wanted / usable;
    if (take) static_cast<void>(problem_.features.push_back(feature));
    ++rank;
  }
}

template <std::size_t MaxTracks>
StartFeature StartWindow<MaxTracks>::history(std::uint32_t track_id,
                                             const FixedVector<std::size_t, kMaxStartImages>& chosen) const {
  StartFeature feature;
  for (std::size_t i = 0; i + 1 < chosen.size(); ++i) {
    const auto& seen = frames_[chosen[i]].observations;
    const auto found = std::lower_bound(seen.begin(), seen.end(), track_id,
                                        [](const FeatureObservation& o, std::uint32_t id) { return o.track_id < id; });
    if (found == seen.end() || found->track_id != track_id) continue;
    static_cast<void>(feature.earlier.push_back({i, Vec2(found->x, found->y)}));
  }
  return feature;
}

}  // namespace plumb
