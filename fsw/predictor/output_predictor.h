#pragma once
// From the delayed estimate to now: the estimator's newest state, carried forward by the IMU samples that came after
// it. The nav job knows the state at an image that is tens of milliseconds old; control wants it at IMU rate and at
// once. Each correction restarts the integration at the image time and runs it again over the samples kept since.
// Bounded work (kMaxSamples steps), no heap, a function of the sequence of calls.

#include <array>
#include <cstddef>
#include <cstdint>

#include "fsw/base/status.h"
#include "fsw/math/strapdown.h"
#include "fsw/measurement/nav_state.h"
#include "fsw/measurement/samples.h"

namespace plumb {

struct OutputPredictorOptions {
  double gravity_m_s2 = 9.80665;
  double max_gap_s = 0.12;  ///< across a longer hole in the IMU stream nothing is predicted until the next correction
};

/// Jump of the output at a correction, corrected minus predicted at the newest sample. Small when estimator and IMU
/// agree; a health number.
struct PredictorTracking {
  double position_m = 0.0;
  double velocity_m_s = 0.0;
  double attitude_rad = 0.0;
};

/// Predictor output at one IMU sample.
struct PredictedState {
  Time t;
  std::array<double, 3> p_WI_m{};
  std::array<double, 3> v_WI_m_s{};
  std::array<double, 4> q_WI{1, 0, 0, 0};  ///< w x y z
  std::uint32_t reset_count = 0;           ///< as in NavState
  NavStatus status{};                      ///< not the predictor's: given by who publishes it
};

struct PredictorCounters {
  std::uint64_t corrections = 0;
  std::uint64_t stale_corrections = 0;  ///< refused: before the samples kept, or before the last correction
  std::uint64_t refused_samples = 0;    ///< not finite or not after the newest one
  std::uint64_t gaps = 0;
};

class OutputPredictor {
 public:
  /// 0.5 s of a 2 kHz IMU; twenty times the delay of a 20 Hz camera with a 200 Hz IMU.
  static constexpr std::size_t kMaxSamples = 1024;

  explicit OutputPredictor(const OutputPredictorOptions& options) : options_(options) {}
  /// Other options from the next sample on.
  void use(const OutputPredictorOptions& options) { options_ = options; }

  /// Keeps the sample and steps the output to it. kOutOfOrder or kInvalidValue: counted, not used.
  Status add_imu(const ImuSample& sample);

  /// Restarts from the estimator's state and integrates to the newest sample. An invalid state makes the output
  /// invalid. kStale: the samples since that time are no longer (or not yet) here. kOutOfOrder: older than the last
  /// correction. Both leave the output as it was. kNumericalFault: not finite, the output becomes invalid.
  Status correct(const NavState& corrected);

  /// The present state, at the newest sample. Invalid before the first correction and after a gap. Position, velocity
  /// and attitude are predicted; biases and covariance are those of the last correction: the growth over the few
  /// milliseconds between, or the hole that was bridged, is left out, so the covariance speaks for the time of the
  /// correction.
  const NavState& state() const { return state_; }
  Time corrected_at() const { return t_corrected_; }
  const PredictorTracking& tracking() const { return tracking_; }
  const PredictorCounters& counters() const { return counters_; }

 private:
  const ImuSample& sample(std::size_t i) const { return ring_[(first_ + i) % kMaxSamples]; }
  void push(const ImuSample& newest);
  void drop_before(Time t);
  void advance(const ImuSample& start, const ImuSample& end);
  void write_state();
  void record_jump(const KinematicState& before, bool comparable);

  OutputPredictorOptions options_;
  std::array<ImuSample, kMaxSamples> ring_{};
  std::size_t first_ = 0;
  std::size_t count_ = 0;
  KinematicState kinematic_;
  Time t_kinematic_ = Time::never();  ///< what kinematic_ is valid at
  Vec3 b_gyro_rad_s_ = Vec3::Zero();
  Vec3 b_accel_m_s2_ = Vec3::Zero();
  Vec3 gyro_scale_ = Vec3::Zero();
  Vec3 accel_scale_ = Vec3::Zero();
  Time t_corrected_ = Time::never();
  NavState state_;
  PredictorTracking tracking_;
  PredictorCounters counters_;
};

}  // namespace plumb
