#include "fsw/app/nav_system.h"

namespace plumb {

template <class Config>
const NavTick& NavSystem<Config>::step(const InputFrame& input, const ImageView* image) {
  ++ticks_;
  tick_.input_status = Status::kOk;
  tick_.image = {};
  if (input.t <= t_last_tick_) {
    ++ticks_out_of_order_;
    tick_.input_status = Status::kOutOfOrder;
    output_.skip();
    return tick_;
  }
  t_last_tick_ = input.t;
  if (input.handover == Handover::kReleased) output_.correct(result_);
  output_.step(input);
  if (input.nav_missed) return tick_;
  tick_.image = job_.step(input, image);
  if (!tick_.image.processed) return tick_;
  result_ = job_.result();
  if (input.handover == Handover::kAtOnce) output_.correct(result_);
  return tick_;
}

template <class Config>
NavSystemCounters NavSystem<Config>::counters() const {
  NavSystemCounters counters = job_.counters();
  counters.ticks = ticks_;
  counters.ticks_out_of_order = ticks_out_of_order_;
  return counters;
}

template <class Config>
HealthRecord NavSystem<Config>::health() const {
  HealthRecord health = output_.health(t_last_tick_, job_.result());
  health.system = counters();
  return health;
}

template class NavSystem<PaperConfig>;
template class NavSystem<FlightConfig>;
template class NavSystem<SelfCalibratingConfig>;

}  // namespace plumb
