#pragma once
// The flight clock, and the one place where a flight thread waits for it.

#include "fsw/base/time.h"

namespace plumb {

class Clock {
 public:
  virtual ~Clock() = default;

  /// Any thread.
  virtual Time now() const = 0;
  /// Returns at `t`, or sooner when somebody has called wake() since the last return. One thread waits on a clock.
  /// Physical time is awaited here and nowhere else in flight code; in replay it returns at once.
  virtual void wait_until(Time t) = 0;
  /// Any thread: there is something to do before the time that is waited for.
  virtual void wake() = 0;
};

}  // namespace plumb
