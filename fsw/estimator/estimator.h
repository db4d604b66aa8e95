#pragma once
// The estimator as the rest of Plumb sees it: samples and feature frames in, navigation state out.
// Everything is a function of the sequence of calls; nothing here allocates, waits or reads a clock.

#include <cstdint>
#include <optional>

#include "fsw/base/stage_observer.h"
#include "fsw/base/status.h"
#include "fsw/estimator/direction_update.h"
#include "fsw/estimator/imu_buffer.h"
#include "fsw/estimator/options.h"
#include "fsw/estimator/range_update.h"
#include "fsw/estimator/report.h"
#include "fsw/estimator/standing.h"
#include "fsw/estimator/start_window.h"
#include "fsw/estimator/visual_update.h"
#include "fsw/measurement/nav_state.h"
#include "fsw/measurement/samples.h"
#include "fsw/vision/feature_frame.h"
#include "fsw/vision/track_table.h"
#include "fsw/vision/tracker.h"

namespace plumb {

template <class Config>
class Estimator {
 public:
  using Frame = FeatureFrame<Config::kMaxTracks>;

  Estimator(const EstimatorOptions& options, const SensorCalibration& calibration, StageObserver* observer = nullptr);

  /// Other options from here on. What they say of the start counts at the next one; the state goes on as it is.
  void use(const EstimatorOptions& options);

  /// Back to "initialising". Counters stay; reset_count goes up by one. The IMU buffer is kept.
  void reset();

  /// Buffers one sample. kOutOfOrder, kInvalidValue: counted and dropped.
  Status add_imu(const ImuSample& sample);
  /// Buffers one range; it is used once, at its own time, by the next process() that reaches it. kInvalidValue, kStale,
  /// kFull: counted and dropped.
  Status add_range(const RangeSample& sample);

  /// Buffers one direction for the next image at or after it; the first that agree turn the world to its true heading,
  /// which position and velocity follow. kInvalidValue, kOutOfOrder: counted and dropped.
  Status add_direction(const DirectionSample& sample) { return direction_.add(sample, counters_); }

  /// True when the buffered IMU reaches the image with this stamp, so that process() can integrate exactly to it.
  bool imu_reaches(Time stamp) const { return imu_.newest() >= state_.calibration().imu_time(stamp); }
  /// Camera rotation from the last processed image to the one with this stamp, from the gyro as estimated; and
  /// where in it the spots of the ranges so far are.
  MotionPrediction predict_motion(Time stamp) const;

  /// Fuses everything up to the image time and then the image. kNotReady while initialising (state().valid is false);
  /// kOutOfOrder and kStale (no IMU around the image): counted and dropped; kNumericalFault: the filter has been reset.
  Status process(const Frame& frame);

  /// Start from a known state (comparisons only): position, velocity, attitude and biases of `truth`, taken as they are
  /// at the next image.
  void start_from(const NavState& truth);

  /// The state at the newest processed image. Its time is the IMU's: the image's stamp and the estimated time offset.
  const NavState& state() const { return nav_; }
  const FrameReport& report() const { return report_; }
  /// The features in the state, for pictures and logs.
  const FixedVector<SlamFeature, Config::kMaxSlamFeatures>& slam_features() const { return state_.features; }
  /// All of the filter, for analyses.
  const FilterState<Config>& filter() const { return state_; }
  const EstimatorCounters& counters() const { return counters_; }
  /// What the filter has made of the sensors' calibration.
  CalibrationReport calibration() const { return state_.calibration_report(); }
  /// What it takes for the noise of a tracked feature, 1 sigma.
  double pixel_noise_px() const { return visual_.pixel_noise_px(); }
  /// 64-bit hash over all that is carried from image to image once the filter runs, every bit of it: the nominal state,
  /// the whole covariance, the tracks, what is remembered of ranges, images and IMU samples. Two estimators that agree
  /// in it and are given the same from now on agree for ever. Samples that wait to be used are not in it: when they
  /// arrive does not matter.
  std::uint64_t state_hash() const {
    Hash64 h;
    h.add(state_.hash());
    for (const SlamFeature& feature : state_.features) {
      h.add(static_cast<std::uint64_t>(feature.consecutive_rejections));
      h.add(std::uint64_t{feature.ranged ? 1U : 0U});
      h.add(static_cast<std::uint64_t>(feature.ranges_missed));
      h.add(static_cast<std::uint64_t>(feature.t_range.ns()));
    }
    h.add(std::uint64_t{standing_ ? 1U : 0U});
    h.add(std::uint64_t{started_excited_ ? 1U : 0U});
    tracks_.add_to(h);
    visual_.add_to(h);
    range_.add_to(h);
    direction_.add_to(h);
    image_stillness_.add_to(h);
    imu_.add_to(h, state_.t);
    h.add(range_depths_m_.data(), range_depths_m_.size());
    for (const Time t :
         {last_kept_t_, last_visual_t_, last_range_t_, last_range_sample_t_, last_ranged_track_t_, started_t_})
      h.add(static_cast<std::uint64_t>(t.ns()));
    return h.value();
  }

 private:
  using Table = TrackTable<Config::kMaxTracks, Config::kMaxPoses>;

  Status fuse_image(const Frame& frame);
  Status fuse_ranges_until(Time t, bool including);
  void drop_oldest_range(RangeOutcome outcome);
  void drop_ranges_before(Time t, RangeOutcome outcome);
  /// Takes the oldest range out of the queue: from here on it is the last one that is known.
  RangeSample take_range();
  /// The spot of a laser, seen from the camera some time later.
  struct LaserSpot {
    Vec2 z = Vec2::Zero();  ///< normalised image plane
    double depth_m = 0.0;   ///< along the optical axis
    double cos_axis = 0.0;  ///< between beam and optical axis
    RangeRay ray;
    Vec3 p_W_m = Vec3::Zero();
    Vec3 beam_W = Vec3::Zero();  ///< its direction
    bool moves = false;          ///< across its ray, so that a track there will show parallax
  };
  /// A feature at the laser's spot, and how far it is from the beam.
  struct SpotFeature {
    std::size_t index = 0;
    double off_m = 0.0;
  };
  /// Nothing while the vehicle stands.
  std::optional<LaserSpot> laser_spot(const RangeSample& range, Time t) const;
  bool moves_across(const LaserSpot& spot, Time t) const;
  bool tracks_serve(Time t) const;
  bool ranges_tell_scale(Time t) const;
  std::optional<SpotFeature> feature_at(const LaserSpot& spot) const;
  bool ranges_agree() const;
  bool give_to_track(const LaserSpot& spot, Time t);
  /// With the feature at the laser's spot, or without one with the facet under the beam.
  Status compare_range(const RangeSample& range, const std::optional<SpotFeature>& feature);
  void propagate_to(Time t);
  void coast();
  /// Whether the pose of the image at t is to stay in the window: at high image rates not all do, so that the window
  /// spans a baseline.
  bool stays(Time t) const {
    if (last_kept_t_ == Time::never() || last_kept_t_ == t) return true;
    return (t - last_kept_t_).seconds() >= options_.vision.pose_interval_s;
  }
  void make_room_for_clone(Time t);
  StandingNoise standing_noise() const;
  Status fuse_standing(Time t);
  Status fuse_directions(Time t);
  Status start(const Frame& frame);
  Status start_standing(const Frame& frame);
  Status start_in_motion(const Frame& frame);
  void start_from_given(const Frame& frame);
  /// Nothing is known but the calibration, as the file says.
  void clear_state() {
    state_.clear();
    state_.set_calibration(calibration_, {});
  }
  void begin_filter(Time t, const CoreState& core, const Mat15& covariance);
  /// Independent priors; yaw and position pinned, biases from the options.
  Mat15 start_covariance(double tilt_rad, double velocity_m_s) const;
  DepthPrior depth_prior() const;
  /// Of the last range, along the optical axis; 0 when there is none of late.
  double recent_range_depth_m() const;
  /// Of the features whose depth is known; 0 when there are too few.
  double median_depth_m() const;
  void publish(bool visual, Time t);

  EstimatorOptions options_;
  SensorCalibration calibration_;
  StageObserver* observer_;

  ImuBuffer imu_;
  PendingRanges ranges_;
  FilterState<Config> state_;
  Table tracks_;
  UpdateStack<Config> stack_;
  VisualUpdate<Config> visual_;
  RangeUpdate<Config> range_;
  DirectionUpdate<Config> direction_;
  ImageStillness<Config::kMaxTracks> image_stillness_;
  StartWindow<Config::kMaxTracks> start_window_;

  bool initialised_ = false;
  bool standing_ = false;
  double max_flow_per_s_ = 0.0;  ///< while standing: image motion that could go unnoticed
  bool start_given_ = false;
  NavState given_;
  Time last_frame_t_;
  Time last_kept_t_;  ///< newest image whose pose stays in the window while others come
  Time last_visual_t_;
  Time last_range_t_;         ///< the last range, or image with a ranged track, that was used
  Time last_ranged_track_t_;  ///< the last image whose tracks made use of a range
  Time last_range_sample_t_;
  Time started_t_;
  bool started_excited_ = false;           ///< in motion that told the scale
  FixedVector<double, 3> range_depths_m_;  ///< of the last ranges, along the optical axis, oldest first

  NavState nav_;
  FrameReport report_;
  EstimatorCounters counters_;
};

}  // namespace plumb
