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
      : parameters_(parameter_table(), parameters),
        predictor_(predictor_options(parameters)),
        monitor_(parameters.modes) {}

  /// Carries the commands of a tick out and the output on by the samples of a tick; what came of each is in
  /// predicted(). A sample that the estimator would refuse, by its values or its stamp, is not used here either.
  void step(const InputFrame& input);
  /// A tick that is not used: nothing is predicted, nothing told.
  void skip();
  /// The result that is in force from here on. Refusals are in the predictor's counters; the output then goes on.
  void correct(const NavResult& result);

  /// Of the newest step: one per IMU sample once there is a state; while there is none to act on, at least one that
  /// says so.
  const Predicted& predicted() const { return predicted_; }
  const FlightMonitor::Events& events() const { return monitor_.events(); }
  NavMode mode() const { return monitor_.mode(); }
  const OutputPredictor& predictor() const { return predictor_; }
  const ParameterStore& parameters() const { return parameters_; }
  /// ParamStore::check(), and all that works with copies of the parameters gets them anew. Changes nothing where memory
  /// is sound.
  ParamDamage check_parameters() {
    const ParamDamage damage = parameters_.check();
    use_parameters();
    return damage;
  }
  /// The output's part and that of the newest result, for the record of health at t.
  HealthRecord health(Time t, const NavResult& result) const;

 private:
  static OutputPredictorOptions predictor_options(const Parameters& parameters) {
    const ImuOptions& imu = parameters.estimator.imu;
    return {.gravity_m_s2 = imu.gravity_m_s2, .max_gap_s = imu.max_gap_s};
  }
  void use_parameters() {
    predictor_.use(predictor_options(parameters_.active()));
    monitor_.use(parameters_.active().modes);
  }
  NavStatus status_at(Time t) const;

  ParameterStore parameters_;
  OutputPredictor predictor_;
  FlightMonitor monitor_;
  double reliable_for_s_ = 0.0;  ///< from predictor_.corrected_at()
  Time t_imu_ = Time::never();   ///< newest sample of use
  NavStatus status_;
  Predicted predicted_;
};

}  // namespace plumb
