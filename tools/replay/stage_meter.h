#pragma once
// What each stage of the nav job costs: CPU time of this thread and calls of the allocator, per image.

#include <array>
#include <cstdint>

#include "fsw/base/stage_observer.h"

namespace plumb::replay {

/// CPU time of this thread [ns].
std::int64_t thread_cpu_ns();

struct StageCost {
  std::int64_t cpu_ns = 0;
  std::uint64_t heap_calls = 0;
};

class StageMeter final : public StageObserver {
 public:
  void enter(Stage stage) override;
  void leave(Stage stage) override;

  /// Costs since the last clear().
  const StageCost& cost(Stage stage) const { return costs_[static_cast<std::size_t>(stage)]; }
  /// Everything but the front end.
  StageCost filter() const;
  void clear() { costs_ = {}; }

 private:
  std::array<StageCost, kStageCount> costs_{};
  std::int64_t entered_cpu_ns_ = 0;
  std::uint64_t entered_heap_calls_ = 0;
};

}  // namespace plumb::replay
