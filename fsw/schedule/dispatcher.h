#pragma once
// Runs the jobs of one tick in the order of their table and keeps account of them. It knows no clock: it is handed one,
// and nothing that a job computes depends on what the clock says.

#include <array>
#include <cstddef>
#include <cstdint>

#include "fsw/schedule/job_account.h"
#include "fsw/schedule/schedule.h"

namespace plumb {

/// `Table` is an array of Job that check_schedule() has passed.
template <const auto& Table>
class Dispatcher {
 public:
  static constexpr std::size_t kJobs = std::size(Table);
  static_assert(kJobs <= 64, "a schedule has a page, not a book");

  /// Runs what is due in `tick`, which counts every tick from 0. `now()` is the flight clock, `run(row)` does the job
  /// of that row, `tell(fact)` takes the overruns and slips to be told.
  template <class Now, class Run, class Tell>
  void dispatch(std::uint64_t tick, Now now, Run run, Tell tell) {
    for (std::size_t row = 0; row < kJobs; ++row) {
      if (Table[row].thread != Thread::kTick || !Table[row].due_in(tick)) continue;
      const Time start = now();
      run(row);
      account(row, start, now(), tell);
    }
  }

  /// A run of a job beside the ticks, told by its owner. Call it on the thread that calls dispatch().
  template <class Tell>
  void account(std::size_t row, Time start, Time end, Tell tell) {
    PLUMB_ASSERT(row < kJobs);
    for (const ScheduleFact& fact : accounts_[row].add(Table[row], static_cast<std::uint8_t>(row), start, end))
      tell(fact);
  }

  const JobAccount& of(std::size_t row) const {
    PLUMB_ASSERT(row < kJobs);
    return accounts_[row];
  }

 private:
  std::array<JobAccount, kJobs> accounts_{};
};

}  // namespace plumb
