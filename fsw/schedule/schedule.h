#pragma once
// The schedule: which job runs in which tick, for how long at most, and when its result counts. A table that is checked
// when it is compiled, so that a schedule that cannot hold is not built.

#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <span>
#include <string_view>

#include "fsw/base/time.h"

namespace plumb {

/// 250 Hz: the rate of the executive.
inline constexpr Duration kTickPeriod = Duration::from_ms(4);
/// A table whose jobs come together only after longer than this cannot be looked through by a reader.
inline constexpr std::uint32_t kMaxHyperPeriodTicks = 1000;

/// A set of the records that jobs hand to each other: one bit each, which the owner of the table gives out.
using DataSet = std::uint32_t;

enum class Thread : std::uint8_t {
  kTick = 0,  ///< in the tick itself, in the order of the table
  kOwn,       ///< beside the ticks, under logical execution time
};

struct Job {
  std::string_view name;
  Thread thread = Thread::kTick;
  std::uint32_t period_ticks = 1;
  std::uint32_t offset_ticks = 0;  ///< the first tick of the job
  Duration budget;                 ///< physical time of one run; longer is an overrun
  /// Logical execution time: a result counts from that many ticks after its job was released, however early it is
  /// there. 0: within the tick. What the outside sees then depends on the schedule and not on the speed of the machine.
  std::uint32_t logical_ticks = 0;
  DataSet inputs = 0;
  DataSet outputs = 0;

  constexpr bool due_in(std::uint64_t tick) const {
    return tick >= offset_ticks && (tick - offset_ticks) % period_ticks == 0;
  }
};

using JobTable = std::span<const Job>;

/// Ticks after which the pattern of due jobs repeats; 0 when a period is 0, the largest number when it is beyond that.
constexpr std::uint32_t hyper_period_ticks(JobTable jobs) {
  std::uint64_t ticks = 1;
  for (const Job& job : jobs) {
    if (job.period_ticks == 0) return 0;
    ticks = std::lcm(ticks, std::uint64_t{job.period_ticks});
    if (ticks > kMaxHyperPeriodTicks) return std::numeric_limits<std::uint32_t>::max();
  }
  return static_cast<std::uint32_t>(ticks);
}

constexpr bool names_are_unique(JobTable jobs) {
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    if (jobs[i].name.empty()) return false;
    for (std::size_t k = 0; k < i; ++k) {
      if (jobs[k].name == jobs[i].name) return false;
    }
  }
  return true;
}

constexpr bool offsets_are_within_periods(JobTable jobs) {
  for (const Job& job : jobs) {
    if (job.offset_ticks >= job.period_ticks) return false;
  }
  return true;
}

constexpr bool hyper_period_fits(JobTable jobs) {
  const std::uint32_t ticks = hyper_period_ticks(jobs);
  return ticks >= 1 && ticks <= kMaxHyperPeriodTicks;
}

/// The jobs of the busiest tick together. Precondition: the hyper-period fits.
constexpr Duration busiest_tick(JobTable jobs) {
  Duration most;
  // Offsets are below the periods, so from the first hyper-period on every tick is as those here.
  const std::uint32_t pattern = hyper_period_ticks(jobs);
  for (std::uint32_t tick = pattern; tick < 2 * pattern; ++tick) {
    Duration sum;
    for (const Job& job : jobs) {
      if (job.thread == Thread::kTick && job.due_in(tick)) sum = sum + job.budget;
    }
    if (sum > most) most = sum;
  }
  return most;
}

constexpr bool budgets_are_positive(JobTable jobs) {
  for (const Job& job : jobs) {
    if (job.budget <= Duration()) return false;
  }
  return true;
}

constexpr bool budgets_fit_the_tick(JobTable jobs) {
  return hyper_period_fits(jobs) && busiest_tick(jobs) <= kTickPeriod;
}

/// A job beside the ticks ends within its logical execution time, and this before the job is released again. A job in
/// the tick has none.
constexpr bool logical_times_hold(JobTable jobs) {
  for (const Job& job : jobs) {
    if (job.thread == Thread::kTick && job.logical_ticks != 0) return false;
    if (job.thread == Thread::kTick) continue;
    if (job.logical_ticks == 0 || job.logical_ticks > job.period_ticks) return false;
    if (job.budget > kTickPeriod * job.logical_ticks) return false;
  }
  return true;
}

constexpr bool every_record_has_one_writer(JobTable jobs, DataSet external) {
  DataSet written = external;
  for (const Job& job : jobs) {
    if ((job.outputs & written) != 0) return false;
    written |= job.outputs;
  }
  return true;
}

constexpr bool every_input_is_written(JobTable jobs, DataSet external) {
  DataSet written = external;
  for (const Job& job : jobs) written |= job.outputs;
  for (const Job& job : jobs) {
    if ((job.inputs & ~written) != 0) return false;
  }
  return true;
}

/// Within a tick a job stands after those it reads from. What comes from a job beside the ticks is of an earlier tick.
constexpr bool readers_follow_writers(JobTable jobs) {
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    for (std::size_t k = i; k < jobs.size(); ++k) {
      if (jobs[k].thread == Thread::kTick && (jobs[i].inputs & jobs[k].outputs) != 0) return false;
    }
  }
  return true;
}

/// Refuses a table that cannot hold, with the reason. `External`: records that come from outside the schedule.
template <const auto& Table, DataSet External>
constexpr bool check_schedule() {
  constexpr JobTable kJobs(Table);
  static_assert(names_are_unique(kJobs), "every job needs a name of its own");
  static_assert(offsets_are_within_periods(kJobs), "the offset of a job must be below its period");
  static_assert(hyper_period_fits(kJobs), "the periods of the jobs repeat together only after kMaxHyperPeriodTicks");
  static_assert(budgets_are_positive(kJobs), "every job needs a budget");
  static_assert(budgets_fit_the_tick(kJobs), "the budgets of the jobs that are due in one tick exceed the tick");
  static_assert(logical_times_hold(kJobs),
                "logical execution time: none for a job in the tick; for one beside it no less than its budget and no "
                "more than its period");
  static_assert(every_record_has_one_writer(kJobs, External), "two jobs write the same record");
  static_assert(every_input_is_written(kJobs, External), "a job reads what nobody writes");
  static_assert(readers_follow_writers(kJobs), "a job in the tick stands before one whose record it reads");
  return true;
}

}  // namespace plumb
