#pragma once
// Clock of a replay: it is as late as the recording says, and nobody waits for it.

#include "hal/include/clock.h"

namespace plumb {

class ReplayClock final : public Clock {
 public:
  Time now() const override { return now_; }
  void wait_until(Time t) override { now_ = t; }
  void wake() override {}

 private:
  Time now_;
};

}  // namespace plumb
