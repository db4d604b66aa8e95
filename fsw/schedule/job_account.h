#pragma once
// What a job did with its time. Two facts that are often taken for one: an overrun is a run that took longer than its
// budget, a slip is a whole period in which the job was not run. Both are always counted and seldom told. A job with a
// thread of its own runs when there is something for it, so it cannot slip; what it misses is the gate's to tell.

#include <cstdint>

#include "fsw/base/fixed_vector.h"
#include "fsw/base/throttle.h"
#include "fsw/base/time.h"
#include "fsw/schedule/schedule.h"

namespace plumb {

/// An overrun or a slip that is to be told.
struct ScheduleFact {
  enum class Kind : std::uint8_t { kOverrun = 0, kSlip };
  Kind kind = Kind::kOverrun;
  std::uint8_t job = 0;          ///< row of the table
  Time t;                        ///< start of the run
  Duration time;                 ///< that the run took; from the last start to this one
  std::uint64_t suppressed = 0;  ///< facts of this job and kind before this one that were not told
};

class JobAccount {
 public:
  using Facts = FixedVector<ScheduleFact, 2>;
  static constexpr std::uint32_t kBurst = 3;  ///< facts of a kind told at once, then one in each kToldPeriod
  static constexpr Duration kToldPeriod = Duration::from_ms(1000);

  /// A run from `start` to `end` on the flight clock; what of it is to be told. `index`: of the job in its table.
  Facts add(const Job& job, std::uint8_t index, Time start, Time end) {
    Facts facts;
    // From start to start: a job that merely starts late and in time again has not slipped.
    const Duration since = runs_ > 0 ? start - t_start_ : Duration();
    const Duration period = kTickPeriod * job.period_ticks;
    t_start_ = start;
    last_ = end - start;
    total_ = total_ + last_;
    if (last_ > max_) max_ = last_;
    ++runs_;
    const auto tell = [&](ScheduleFact::Kind kind, Duration time, Throttle& throttle) {
      if (!throttle.admit(start)) return;
      const Status added =
          facts.push_back({.kind = kind, .job = index, .t = start, .time = time, .suppressed = throttle.suppressed()});
      PLUMB_ASSERT(ok(added));  // one of each kind at most
    };
    if (job.thread == Thread::kTick && since >= period * 2) {
      slips_ += static_cast<std::uint64_t>(since.ns() / period.ns() - 1);
      tell(ScheduleFact::Kind::kSlip, since, slip_throttle_);
    }
    if (last_ > job.budget) {
      ++overruns_;
      tell(ScheduleFact::Kind::kOverrun, last_, overrun_throttle_);
    }
    return facts;
  }

  std::uint64_t runs() const { return runs_; }
  std::uint64_t overruns() const { return overruns_; }
  std::uint64_t slips() const { return slips_; }  ///< periods left out
  Duration last() const { return last_; }
  Duration max() const { return max_; }
  Duration mean() const { return runs_ == 0 ? Duration() : total_ / static_cast<std::int64_t>(runs_); }

 private:
  std::uint64_t runs_ = 0;
  std::uint64_t overruns_ = 0;
  std::uint64_t slips_ = 0;
  Duration last_;
  Duration max_;
  Duration total_;
  Time t_start_;
  Throttle overrun_throttle_{kBurst, kToldPeriod};
  Throttle slip_throttle_{kBurst, kToldPeriod};
};

}  // namespace plumb
