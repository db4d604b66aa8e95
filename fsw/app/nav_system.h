#pragma once
// The navigation software in one thread: InputFrames in, navigation state out, tick by tick. The same two halves fly
// live, in two threads (fsw/app/tick_task.h, fsw/app/nav_task.h); what their timing decided is in the InputFrames, so
// this gives the same bits. A large object, so it belongs in static storage, not on a stack.

#include <cstdint>

#include "fsw/app/nav_job.h"
#include "fsw/app/output_stage.h"

namespace plumb {

/// What one call of step() did.
struct NavTick {
  Status input_status = Status::kOk;  ///< kOutOfOrder: the tick's time was not after the last one; nothing was used
  ImageOutcome image;
  const OutputStage::Predicted& predicted;  ///< see OutputStage::predicted()
  const FlightMonitor::Events& events;
};

template <class Config>
class NavSystem {
 public:
  /// `tracker` and `observer` (may be null) must outlive this object.
  NavSystem(const Calibration& calibration, const Parameters& parameters, Tracker<Config::kMaxTracks>& tracker,
            StageObserver* observer)
      : job_(calibration, parameters, tracker, observer), output_(parameters) {}

  /// Runs one tick: releases what is to be released, carries the output on, and lets the nav job work. `image` as in
  /// NavJob::step().
  const NavTick& step(const InputFrame& input, const ImageView* image);

  /// Start from a known state (comparisons only); see Estimator::start_from.
  void start_from(const NavState& truth) { job_.start_from(truth); }

  const NavJob<Config>& job() const { return job_; }
  const Estimator<Config>& estimator() const { return job_.estimator(); }
  const OutputPredictor& predictor() const { return output_.predictor(); }
  NavSystemCounters counters() const;
  /// Totals of every part, as of the last tick.
  HealthRecord health() const;

 private:
  NavJob<Config> job_;
  OutputStage output_;
  NavResult result_;  ///< of the nav job, until it is released
  NavTick tick_{.image = {}, .predicted = output_.predicted(), .events = output_.events()};
  Time t_last_tick_ = Time::never();
  std::uint64_t ticks_ = 0;
  std::uint64_t ticks_out_of_order_ = 0;
};

extern template class NavSystem<PaperConfig>;
extern template class NavSystem<FlightConfig>;
extern template class NavSystem<SelfCalibratingConfig>;

}  // namespace plumb
