#include "fsw/modes/mode_machine.h"

namespace plumb {
namespace {

bool within(Time last, Time t, double limit_s) { return last != Time::never() && (t - last).seconds() <= limit_s; }

ConditionSet aiding(bool has_state, Time t, Time t_vision, Time t_range, const ModeOptions& options) {
  ConditionSet conditions = 0;
  if (has_state) conditions |= mode_condition::kState;
  if (!within(t_vision, t, options.image_timeout_s)) conditions |= mode_condition::kImageOld;
  if (!within(t_range, t, options.range_timeout_s)) conditions |= mode_condition::kRangeOld;
  return conditions;
}

}  // namespace

NavMode mode_at_image(const NavState& state, const ModeOptions& options) {
  return entered_state(kModeTable, aiding(state.valid, state.t, state.t_vision, state.t_range, options));
}

NavMode ModeMachine::step(const ModeFacts& facts) {
  remember(facts);
  const Time t = facts.t;
  conditions_ = aiding(facts.has_state, t, facts.t_vision, facts.t_range, options_);
  if (is_silent(facts)) conditions_ |= mode_condition::kImuSilent;
  if (t_steady_since_ == Time::never() || within(t_steady_since_, t, options_.steady_s)) {
    conditions_ |= mode_condition::kImuUnsteady;
  }
  if (is_reset_storm(t)) conditions_ |= mode_condition::kResetStorm;
  if (t_fault_ != Time::never() && !within(t_fault_, t, options_.fault_recovery_s)) {
    conditions_ |= mode_condition::kFaultStands;
  }
  mode_ = next_state(kModeTable, mode_, conditions_);
  return mode_;
}

void ModeMachine::remember(const ModeFacts& facts) {
  if (t_start_ == Time::never()) t_start_ = facts.t;
  if (facts.t_imu != last_.t_imu && !within(last_.t_imu, facts.t_imu, options_.imu_timeout_s)) {
    t_steady_since_ = facts.t_imu;
  }
  for (std::uint64_t i = last_.resets; i < facts.resets && i < last_.resets + kMaxResets; ++i) {
    if (resets_.full()) resets_.erase(0);
    static_cast<void>(resets_.push_back(facts.t));
  }
  if (facts.numerical_faults != last_.numerical_faults) {
    t_fault_ = facts.t;
  } else if (facts.has_state) {
    t_fault_ = Time::never();
  }
  last_ = facts;
}

bool ModeMachine::is_silent(const ModeFacts& facts) const {
  if (facts.t_imu == Time::never()) return !within(t_start_, facts.t, options_.start_time_s);
  return !within(facts.t_imu, facts.t, options_.imu_timeout_s);
}

bool ModeMachine::is_reset_storm(Time t) const {
  int recent = 0;
  for (const Time reset : resets_) recent += within(reset, t, options_.reset_window_s) ? 1 : 0;
  return recent >= options_.max_resets;
}

}  // namespace plumb
