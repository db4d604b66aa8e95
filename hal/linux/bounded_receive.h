#pragma once
// The loop of every port that receives: it blocks no longer than it is told, whatever the other side sends.

#include <algorithm>

#include "fsw/base/status.h"
#include "hal/linux/monotonic_clock.h"

namespace plumb {

/// How often and how long receive_within() tries.
struct ReceiveLimits {
  Duration timeout;        ///< zero or less: takes what is there
  Duration reopen_period;  ///< a device that is away is looked for no more often
  int most_looks = 1;      ///< at things that turn out to be none, in one call
};

/// The next item. `come_back()`: whether the device is there, or could be opened again. `take()`: a Result at once, and
/// kNotReady where there is nothing to take, kInvalidValue where that was no item, kRejected where the device failed.
/// `file()`: what to wait on. kNotReady: nothing came in time; kRejected: the device is away or failed.
template <typename ComeBack, typename Take, typename File>
auto receive_within(const ReceiveLimits& limits, ComeBack come_back, Take take, File file) -> decltype(take()) {
  const Time deadline = clock_now() + std::max(limits.timeout, Duration());
  for (int looked = 0; looked < limits.most_looks; ++looked) {
    if (!come_back()) {
      // So that a caller's loop does not spin.
      static_cast<void>(wait_for(-1, POLLIN, std::min(limits.timeout, limits.reopen_period)));
      return Status::kRejected;
    }
    const auto taken = take();
    if (taken || taken.status() == Status::kRejected) return taken;
    if (taken.status() == Status::kInvalidValue) continue;
    const Duration left = deadline - clock_now();
    if (left <= Duration()) return Status::kNotReady;
    static_cast<void>(wait_for(file(), POLLIN, left));  // whatever it says, the next take() tells what there is
  }
  return Status::kNotReady;
}

}  // namespace plumb
