#pragma once
// The half of the navigation software that keeps the beat: from the newest released result of the nav job to now, once
// per IMU sample, in the tick that brings it.

#include "fsw/base/fixed_vector.h"
#include "fsw/estimator/options.h"
#include "fsw/measurement/input_frame.h"
#include "fsw/predictor/output_predictor.h"

namespace plumb {

class OutputStage {
 public:
  using Predicted = FixedVector<PredictedState, kMaxImuPerFrame>;

  explicit OutputStage(const ImuOptions& options)
      : options_(options), predictor_({.gravity_m_s2 = options.gravity_m_s2, .max_gap_s = options.max_gap_s}) {}

  /// Carries the output on by the samples of a tick; what came of each is in predicted(). A sample that the estimator
  /// would refuse, by its values or its stamp, is not used here either.
  void step(const InputFrame& input);
  /// The estimate that is in force from here on. Refusals are in the predictor's counters; the output then goes on.
  void correct(const NavState& state) { static_cast<void>(predictor_.correct(state)); }

  /// Of the newest step: one per IMU sample, once there is a state.
  const Predicted& predicted() const { return predicted_; }
  const OutputPredictor& predictor() const { return predictor_; }

 private:
  ImuOptions options_;
  OutputPredictor predictor_;
  Predicted predicted_;
};

}  // namespace plumb
