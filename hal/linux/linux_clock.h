#pragma once
// Clock on CLOCK_MONOTONIC. A thread that waits has one of its own.

#include <semaphore.h>

#include "hal/include/clock.h"
#include "hal/linux/monotonic_clock.h"

namespace plumb {

class LinuxClock final : public Clock {
 public:
  LinuxClock() { sem_init(&wakes_, 0, 0); }
  ~LinuxClock() override { sem_destroy(&wakes_); }
  LinuxClock(const LinuxClock&) = delete;
  LinuxClock& operator=(const LinuxClock&) = delete;

  Time now() const override { return clock_now(); }
  void wait_until(Time t) override {
    const std::int64_t ns = std::max<std::int64_t>(t.ns(), 0);
    const timespec deadline{.tv_sec = static_cast<time_t>(ns / kNsPerSecond),
                            .tv_nsec = static_cast<long>(ns % kNsPerSecond)};
    // A signal ends it too; whoever waits looks what there is to do and waits again.
    if (sem_clockwait(&wakes_, CLOCK_MONOTONIC, &deadline) != 0) return;
    while (sem_trywait(&wakes_) == 0) {  // wakes while it was away are one: at most as many as were made meanwhile
    }
  }
  void wake() override { sem_post(&wakes_); }

 private:
  sem_t wakes_;
};

}  // namespace plumb
