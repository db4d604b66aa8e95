#include "fsw/app/output_stage.h"

#include <algorithm>

#include "fsw/estimator/imu_limits.h"

namespace plumb {

void OutputStage::step(const InputFrame& input) {
  predicted_.clear();
  FixedVector<ParameterChange, kMaxCommandsPerFrame> changes;
  for (const Command& command : input.commands) {
    if (const auto change = carry_out(command, parameters_)) static_cast<void>(changes.push_back(*change));
  }
  if (!changes.empty()) use_parameters();
  SensorTick imu;
  for (const ImuSample& sample : input.imu) {
    ++imu.samples;
    if (sample.t > input.t || !is_within_limits(sample, parameters_.active().estimator.imu) ||
        !ok(predictor_.add_imu(sample))) {
      ++imu.refused;
      continue;
    }
    ++imu.accepted;
    t_imu_ = sample.t;
    const NavState& now = predictor_.state();
    if (!now.valid) continue;
    const Status kept = predicted_.push_back(
        {.t = now.t, .p_WI_m = now.p_WI_m, .v_WI_m_s = now.v_WI_m_s, .q_WI = now.q_WI, .reset_count = now.reset_count});
    PLUMB_ASSERT(ok(kept));  // one per IMU sample of the tick: both have the same capacity
  }
  monitor_.step(
      input, {.imu = imu, .t_imu = t_imu_, .state = predictor_.state(), .changes = {changes.begin(), changes.end()}});
  for (PredictedState& state : predicted_) state.status = status_at(state.t);
  status_ = status_at(input.t);
  if (predicted_.empty() && !status_.valid) {
    const PredictedState none{.t = input.t, .reset_count = predictor_.state().reset_count, .status = status_};
    static_cast<void>(predicted_.push_back(none));
  }
}

void OutputStage::skip() {
  predicted_.clear();
  monitor_.skip();
}

void OutputStage::correct(const NavResult& result) {
  monitor_.take(result);
  if (ok(predictor_.correct(result.state))) reliable_for_s_ = result.reliable_for_s;
}

HealthRecord OutputStage::health(Time t, const NavResult& result) const {
  return {.t = t,
          .estimator = result.estimator,
          .system = result.system,
          .predictor = predictor_.counters(),
          .tracking = predictor_.tracking(),
          .calibration = result.calibration,
          .pixel_noise_px = result.pixel_noise_px,
          .status = status_,
          .sensors = monitor_.sensors()};
}

NavStatus OutputStage::status_at(Time t) const {
  const NavMode mode = monitor_.mode();
  const bool valid = predictor_.state().valid && mode != NavMode::kFailed;
  const double since_s = (t - predictor_.corrected_at()).seconds();
  return {.valid = valid, .mode = mode, .reliable_for_s = valid ? std::max(0.0, reliable_for_s_ - since_s) : 0.0};
}

}  // namespace plumb
