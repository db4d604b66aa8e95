#pragma once
// Feeds an estimator with a simulated flight sample by sample, so that a test can lose, repeat, spoil or delay any of
// them.

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <vector>

#include "fsw/base/mission_config.h"
#include "fsw/estimator/estimator.h"
#include "test/support/sim/flight.h"

namespace plumb::test {

template <class EstimatorType>
class EstimatorFeed {
 public:
  using Frame = typename EstimatorType::Frame;

  EstimatorFeed(const sim::Scene& scene, const sim::FlightSettings& settings)
      : scene_(scene),
        settings_(settings),
        imu_(settings.imu, settings.imu_rate_hz, scene.gravity_m_s2, settings.seed),
        range_(settings.range, settings.seed),
        sun_(settings.sun, DirectionSource::kSun, settings.seed),
        magnetometer_(settings.magnetometer, DirectionSource::kMagnetometer, settings.seed),
        tracker_(settings.tracker, scene_.trajectory, scene_.world, scene_.rig, sim::flight_epoch(), settings.seed),
        events_(sim::flight_events(settings, scene.trajectory.length_s())),
        estimator(std::make_unique<EstimatorType>(sim::matched_options(settings), scene.rig.calibration())) {}

  /// Called for each sample before it is handed over; false: it is lost. May change it, or hand over others itself.
  std::function<bool(ImuSample&)> on_imu = [](ImuSample&) { return true; };
  std::function<bool(RangeSample&)> on_range = [](RangeSample&) { return true; };
  std::function<bool(DirectionSample&)> on_direction = [](DirectionSample&) { return true; };
  std::function<bool(Frame&)> on_frame = [](Frame&) { return true; };
  /// The same for an image at its time, before features are followed in it; process() it later.
  std::function<bool(Time)> on_image = [](Time) { return true; };
  /// Called after each frame the estimator has processed.
  std::function<void(Status)> after_frame = [](Status) {};

  /// Flies on until `t_s` after the start of the trajectory.
  void fly_until(double t_s) {
    for (; next_ < events_.size() && events_[next_].t_s <= t_s; ++next_) take(events_[next_]);
  }

  /// Follows the features into the image at t and hands them over.
  void process(Time t) {
    CameraFrame image;
    image.t_exposure_mid = t;
    image.sequence = sequence_++;
    if (!ok(tracker_.track(image, estimator->predict_motion(t), frame_))) return;
    if (on_frame(frame_)) after_frame(estimator->process(frame_));
  }

  sim::TruthState truth() const { return scene_.trajectory.at((frame_.t - sim::flight_epoch()).seconds()); }
  /// Estimate and truth at the newest image.
  sim::FlightPoint point() const {
    sim::FlightPoint point;
    point.t_s = (frame_.t - sim::flight_epoch()).seconds();
    point.truth = truth();
    point.estimate = estimator->state();
    point.report = estimator->report();
    return point;
  }
  std::uint64_t ranges_offered() const { return ranges_offered_; }

 private:
  void take(const sim::Event& event) {
    const Time t = sim::flight_epoch() + Duration::from_seconds(event.t_s);
    const sim::TruthState at = scene_.trajectory.at(event.t_s);
    if (event.source == sim::Source::kImage) {
      waiting_.push_back(t);
    } else if (event.source == sim::Source::kRange) {
      RangeSample sample = range_.sample(scene_.world, scene_.rig, at, t);
      if (!on_range(sample)) return;
      ++ranges_offered_;
      static_cast<void>(estimator->add_range(sample));
    } else if (event.source == sim::Source::kSun || event.source == sim::Source::kMagnetometer) {
      sim::DirectionModel& sensor = event.source == sim::Source::kSun ? sun_ : magnetometer_;
      DirectionSample sample = sensor.sample(at, t);
      if (on_direction(sample)) static_cast<void>(estimator->add_direction(sample));
    } else {
      ImuSample sample = imu_.sample(at, t);
      if (on_imu(sample)) static_cast<void>(estimator->add_imu(sample));
      if (settings_.start_from_truth && !started_) estimator->start_from(sim::true_nav_state(at, imu_, t));
      started_ = true;
      while (!waiting_.empty() && t >= waiting_.front()) {
        if (on_image(waiting_.front())) process(waiting_.front());
        waiting_.erase(waiting_.begin());
      }
    }
  }

  sim::Scene scene_;
  sim::FlightSettings settings_;
  sim::ImuModel imu_;
  sim::RangeModel range_;
  sim::DirectionModel sun_;
  sim::DirectionModel magnetometer_;
  sim::SimTracker<decltype(Frame::observations)::capacity()> tracker_;
  std::vector<sim::Event> events_;
  std::size_t next_ = 0;
  std::vector<Time> waiting_;
  std::uint32_t sequence_ = 0;
  std::uint64_t ranges_offered_ = 0;
  bool started_ = false;
  Frame frame_;

 public:
  std::unique_ptr<EstimatorType> estimator;
};

/// Over flat ground, moving in all axes from before the first sample on.
inline sim::Scene lively_scene(double length_s) {
  sim::Trajectory flight(Vec3(0.0, 0.0, 5.0), length_s);
  flight.lean(1.0)
      .change_speed(-4.0, 2.0, {0.8, 0.0, 0.0})
      .oscillate(-10.0, length_s + 20.0, {1.0, 0.0, 0.0}, 0.0, 0.41)
      .oscillate(-10.0, length_s + 20.0, {0.0, 0.8, 0.3}, 0.0, 0.37, 0.7)
      .oscillate(-10.0, length_s + 20.0, Vec3::Zero(), 0.4, 0.23, 0.3);
  return {"lively", flight, sim::flat_ground(), sim::nadir_rig()};
}

inline sim::FlightSettings quick_settings(bool start_from_truth) {
  sim::FlightSettings settings;
  settings.tracker.target_tracks = 60;
  settings.start_from_truth = start_from_truth;
  return settings;
}

/// An estimator for lively_scene() whose options `change` alters.
template <class Config, typename Change>
std::unique_ptr<Estimator<Config>> estimator_with(const sim::FlightSettings& settings, Change change) {
  EstimatorOptions options = sim::matched_options(settings);
  change(options);
  return std::make_unique<Estimator<Config>>(options, sim::nadir_rig().calibration());
}

/// One that gives no range to a feature track.
inline std::unique_ptr<Estimator<PaperConfig>> facet_only(const sim::FlightSettings& settings) {
  return estimator_with<PaperConfig>(settings, [](EstimatorOptions& options) { options.range.feature = false; });
}

/// Ranges that have found their place; those that wait for the next image have not.
inline std::uint64_t filed_ranges(const EstimatorCounters& c) {
  return c.ranges_used + c.ranges_feature + c.ranges_spare + c.ranges_gated + c.ranges_no_facet +
         c.ranges_bad_geometry + c.ranges_stale + c.ranges_invalid;
}

inline bool all_finite(const NavState& state) {
  const auto all = [](const auto& values) {
    return std::all_of(values.begin(), values.end(), [](double value) { return std::isfinite(value); });
  };
  return all(state.p_WI_m) && all(state.v_WI_m_s) && all(state.q_WI) && all(state.b_gyro_rad_s) &&
         all(state.b_accel_m_s2) && all(state.covariance);
}

/// Root of the summed variances of the velocity, m/s.
inline double velocity_sigma(const NavState& state) {
  double sum = 0.0;
  for (std::size_t k = 3; k < 6; ++k) sum += state.covariance[k * (kNavErrorSize + 1)];
  return std::sqrt(sum);
}

inline double position_error(const NavState& state, const sim::TruthState& truth) {
  return (Vec3(state.p_WI_m.data()) - truth.p_WI_m).norm();
}

}  // namespace plumb::test
