#pragma once
// A clock that stands where it is put. Nobody waits on it.

#include "hal/include/clock.h"

namespace plumb::test {

class StandingClock : public Clock {
 public:
  Time now() const override { return now_; }
  void wait_until(Time) override {}
  void wake() override {}
  void set(Time t) { now_ = t; }

 private:
  Time now_;
};

}  // namespace plumb::test
