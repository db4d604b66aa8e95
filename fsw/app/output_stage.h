#pragma once
// The half of the navigation software that keeps the beat: from the newest released result of the nav job to now, once
// per IMU sample, in the tick that brings it, and whether that may be acted on.

#include "fsw/app/flight_monitor.h"
#include "fsw/app/parameters.h"
#include "fsw/base/fixed_vector.h"
#include "fsw/measurement/input_frame.h"
#include "fsw/predictor/output_predictor.h"

namespace plumb {

class OutputStage {
 public:
  using Predicted = FixedVector<PredictedState, kMaxImuPerFrame>;

  explicit OutputStage(const Parameters& parameters)
      : options_(parameters.estimator.imu),
        predictor_({.gravity_m_s2 = options_.gravity_m_s2, .max_gap_s = options_.max_gap_s}),
        monitor_(parameters.modes) {}

  /// Carries the output on by the samples of a tick; what came of each is in predicted(). A sample that the estimator
  /// would refuse, by its values or its stamp, is not used here either.
  void step(const InputFrame& input);
  /// A tick that is not used: nothing is predicted, nothing told.
  void skip();
  /// The result that is in force from here on. Refusals are in the predictor's counters; the output then goes on.
  void correct(const NavResult& result);

  /// Of the newest step: one per IMU sample once there is a state; while there is none to act on, at least one that
  /// says so.
  const Predicted& predicted() const { return predicted_; }
  const FlightMonitor::Events& events() const { return monitor_.events(); }
  const OutputPredictor& predictor() const { return predictor_; }
  /// The output's part and that of the newest result, for the record of health at t.
  HealthRecord health(Time t, const NavResult& result) const;

 private:
  NavStatus status_at(Time t) const;

  ImuOptions options_;
  OutputPredictor predictor_;
  FlightMonitor monitor_;
  double reliable_for_s_ = 0.0;  ///< from predictor_.corrected_at()
  Time t_imu_ = Time::never();   ///< newest sample of use
  NavStatus status_;
  Predicted predicted_;
};

}  // namespace plumb
