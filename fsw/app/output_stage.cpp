#include "fsw/app/output_stage.h"

#include "fsw/estimator/imu_limits.h"

namespace plumb {

void OutputStage::step(const InputFrame& input) {
  predicted_.clear();
  for (const ImuSample& sample : input.imu) {
    if (sample.t > input.t || !is_within_limits(sample, options_)) continue;
    if (!ok(predictor_.add_imu(sample))) continue;
    const NavState& now = predictor_.state();
    if (!now.valid) continue;
    const Status kept =
        predicted_.push_back({.t = now.t, .p_WI_m = now.p_WI_m, .v_WI_m_s = now.v_WI_m_s, .q_WI = now.q_WI});
    PLUMB_ASSERT(ok(kept));  // one per IMU sample of the tick: both have the same capacity
  }
}

}  // namespace plumb
