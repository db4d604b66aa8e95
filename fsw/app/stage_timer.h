#pragma once
// What each stage of the nav job takes, by the flight clock: time that passed, interruptions included.

#include <array>

#include "fsw/base/stage_observer.h"
#include "hal/include/clock.h"

namespace plumb {

class StageTimer final : public StageObserver {
 public:
  /// `clock` must outlive the timer.
  explicit StageTimer(const Clock& clock) : clock_(clock) {}

  void enter(Stage) override { t_enter_ = clock_.now(); }
  void leave(Stage stage) override { ns_[static_cast<std::size_t>(stage)] += (clock_.now() - t_enter_).ns(); }
  void clear() { ns_ = {}; }
  const std::array<std::int64_t, kStageCount>& stage_ns() const { return ns_; }

 private:
  const Clock& clock_;
  Time t_enter_;
  std::array<std::int64_t, kStageCount> ns_{};
};

}  // namespace plumb
