#include "fsw/modes/sensor_health.h"

#include <algorithm>

namespace plumb {

SensorState SensorMonitor::step(Time t, const SensorTick& tick) {
  health_.samples += tick.samples;
  health_.refused += tick.refused;
  if (tick.samples > 0) health_.t_last = t;
  if (tick.accepted > 0) {
    accepted_in_a_row_ += tick.accepted;
    health_.refused_in_a_row = 0;
  } else if (tick.refused > 0) {
    accepted_in_a_row_ = 0;
    health_.refused_in_a_row += tick.refused;
    refused_ever_ = true;
  }
  second_.samples += tick.samples;
  second_.accepted += tick.accepted;
  second_.refused += tick.refused;
  end_second(t);
  const ConditionSet now = conditions(t);
  if ((now & sensor_condition::kSilent) != 0) {  // what it says when it is back is judged anew
    health_.refused_in_a_row = accepted_in_a_row_ = 0;
    refused_ever_ = poor_ = false;
  }
  health_.state = next_state(kSensorTable, health_.state, now);
  return health_.state;
}

void SensorMonitor::end_second(Time t) {
  if (t_second_ == Time::never()) t_second_ = t;
  const double span_s = (t - t_second_).seconds();
  if (span_s < 1.0) return;
  health_.rate_hz = second_.samples / span_s;
  best_rate_hz_ = std::max(best_rate_hz_, health_.rate_hz);
  poor_ = health_.rate_hz < options_.poor_rate * best_rate_hz_ ||
          second_.refused > options_.poor_share * (second_.accepted + second_.refused);
  t_second_ = t;
  second_ = {};
}

ConditionSet SensorMonitor::conditions(Time t) const {
  const bool silent = health_.t_last == Time::never() || (t - health_.t_last).seconds() > silence_s_;
  if (silent) return sensor_condition::kSilent;
  const auto at_least = [](std::uint32_t count, int limit) { return count >= static_cast<std::uint32_t>(limit); };
  ConditionSet conditions = 0;
  if (at_least(health_.refused_in_a_row, options_.rejected_after)) conditions |= sensor_condition::kManyRefused;
  if (at_least(health_.refused_in_a_row, options_.degraded_after)) conditions |= sensor_condition::kSomeRefused;
  if (poor_) conditions |= sensor_condition::kPoor;
  if (refused_ever_ && !at_least(accepted_in_a_row_, options_.restored_after)) {
    conditions |= sensor_condition::kUnproven;
  }
  return conditions;
}

}  // namespace plumb
