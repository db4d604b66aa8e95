#include "tools/replay/stage_meter.h"

#include "hal/linux/monotonic_clock.h"
#include "tools/replay/heap_counter.h"

namespace plumb::replay {

std::int64_t thread_cpu_ns() { return clock_now(CLOCK_THREAD_CPUTIME_ID).ns(); }

void StageMeter::enter(Stage) {
  entered_heap_calls_ = heap_calls();
  entered_cpu_ns_ = thread_cpu_ns();
}

void StageMeter::leave(Stage stage) {
  StageCost& cost = costs_[static_cast<std::size_t>(stage)];
  cost.cpu_ns += thread_cpu_ns() - entered_cpu_ns_;
  cost.heap_calls += heap_calls() - entered_heap_calls_;
}

StageCost StageMeter::filter() const {
  StageCost sum;
  for (std::size_t i = 0; i < kStageCount; ++i) {
    if (static_cast<Stage>(i) == Stage::kFrontEnd) continue;
    sum.cpu_ns += costs_[i].cpu_ns;
    sum.heap_calls += costs_[i].heap_calls;
  }
  return sum;
}

}  // namespace plumb::replay
