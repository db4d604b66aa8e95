#pragma once
// Flies an estimator on a scene: samples in time order, images as soon as the IMU reaches them, as the nav system does.

#include <memory>
#include <vector>

#include "fsw/estimator/estimator.h"
#include "test/support/sim/flight_log.h"
#include "test/support/sim/scene.h"
#include "test/support/sim/sim_tracker.h"

namespace plumb::sim {

enum class Source : std::uint8_t { kImu, kRange, kSun, kMagnetometer, kImage };

struct Event {
  double t_s = 0.0;
  Source source = Source::kImu;
};

/// All sample instants of a flight in order of time, then of source. The three clocks have different phases, so that
/// images fall between IMU samples.
std::vector<Event> flight_events(const FlightSettings& settings, double length_s);
/// The flight clock at the start of a trajectory: not zero, so that nobody can confuse the two.
Time flight_epoch();
/// A truth record as start_from() wants it.
NavState true_nav_state(const TruthState& truth, const ImuModel& imu, Time t);

/// EstimatorType is Estimator<Config> or anything with its interface; it must be in its initial state. The estimator
/// has its options already; the settings decide only what the sensors say.
template <class EstimatorType>
class Flight {
 public:
  static constexpr std::size_t kMaxTracks = decltype(EstimatorType::Frame::observations)::capacity();

  /// Scene and estimator must outlive the flight.
  Flight(const Scene& scene, const FlightSettings& settings, EstimatorType& estimator)
      : scene_(scene),
        settings_(settings),
        estimator_(estimator),
        imu_(settings.imu, settings.imu_rate_hz, scene.gravity_m_s2, settings.seed),
        range_(settings.range, settings.seed),
        sun_(settings.sun, DirectionSource::kSun, settings.seed),
        magnetometer_(settings.magnetometer, DirectionSource::kMagnetometer, settings.seed),
        tracker_(settings.tracker, scene.trajectory, scene.world, scene.rig, flight_epoch() - image_delay(),
                 settings.seed) {}

  /// Flies the whole trajectory. Call once.
  FlightLog fly() {
    const Trajectory& trajectory = scene_.trajectory;
    log_.length_s = trajectory.length_s();
    log_.cruise_start_s = trajectory.cruise_start_s();
    log_.cruise_end_s = trajectory.cruise_end_s();
    for (const Event& event : flight_events(settings_, trajectory.length_s())) take(event);
    log_.counters = estimator_.counters();
    return log_;
  }

  const SimTracker<kMaxTracks>& tracker() const { return tracker_; }

 private:
  Duration image_delay() const { return Duration::from_seconds(settings_.image_time_offset_s); }

  void take(const Event& event) {
    const Time t = flight_epoch() + Duration::from_seconds(event.t_s);
    if (event.source == Source::kImage) {
      waiting_.push_back(t - image_delay());
      return;
    }
    const TruthState truth = scene_.trajectory.at(event.t_s);
    if (event.source == Source::kRange) {
      // A refused sample is the estimator's decision, visible in its counters.
      static_cast<void>(estimator_.add_range(range_.sample(scene_.world, scene_.rig, truth, t)));
      return;
    }
    if (event.source == Source::kSun || event.source == Source::kMagnetometer) {
      DirectionModel& sensor = event.source == Source::kSun ? sun_ : magnetometer_;
      static_cast<void>(estimator_.add_direction(sensor.sample(truth, t)));  // likewise
      return;
    }
    static_cast<void>(estimator_.add_imu(imu_.sample(truth, t)));
    process_waiting();
  }

  void process_waiting() {
    while (!waiting_.empty() && estimator_.imu_reaches(waiting_.front())) {
      process(waiting_.front());
      waiting_.erase(waiting_.begin());
    }
  }

  void process(Time t) {  // t: the image's stamp
    const double t_s = (t + image_delay() - flight_epoch()).seconds();
    const TruthState truth = scene_.trajectory.at(t_s);
    CameraFrame image;
    image.t_exposure_mid = t;
    image.sequence = sequence_++;
    if (settings_.start_from_truth && image.sequence == 0) estimator_.start_from(true_nav_state(truth, imu_, t));
    if (!ok(tracker_.track(image, estimator_.predict_motion(t), frame_))) return;
    static_cast<void>(estimator_.process(frame_));  // "not ready" shows as an invalid state
    FlightPoint point;
    const NavState& estimate = estimator_.state();  // speaks of the time that the estimator takes the image for
    point.t_s = estimate.valid ? (estimate.t - flight_epoch()).seconds() : t_s;
    point.truth = scene_.trajectory.at(point.t_s);
    point.gyro_bias_rad_s = imu_.gyro_bias_rad_s();
    point.accel_bias_m_s2 = imu_.accel_bias_m_s2();
    point.estimate = estimate;
    point.report = estimator_.report();
    point.state_hash = estimator_.state_hash();
    log_.points.push_back(point);
  }

  const Scene& scene_;
  FlightSettings settings_;
  EstimatorType& estimator_;
  ImuModel imu_;
  RangeModel range_;
  DirectionModel sun_;
  DirectionModel magnetometer_;
  SimTracker<kMaxTracks> tracker_;
  typename EstimatorType::Frame frame_;
  std::vector<Time> waiting_;
  std::uint32_t sequence_ = 0;
  FlightLog log_;
};

/// A fresh estimator on one flight, with what the calibration file says of the rig.
template <class Config>
FlightLog fly(const Scene& scene, const FlightSettings& settings, const EstimatorOptions& options,
              const SensorCalibration& file) {
  const auto estimator = std::make_unique<Estimator<Config>>(options, file);
  return Flight<Estimator<Config>>(scene, settings, *estimator).fly();
}

template <class Config>
FlightLog fly(const Scene& scene, const FlightSettings& settings, const EstimatorOptions& options) {
  return fly<Config>(scene, settings, options, scene.rig.calibration());
}

}  // namespace plumb::sim
