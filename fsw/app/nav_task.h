#pragma once
// The nav job beside the ticks: takes the frames in order, answers for each image.

#include <utility>

#include "fsw/app/nav_job.h"
#include "fsw/app/nav_link.h"
#include "fsw/app/stage_timer.h"
#include "fsw/app/telemetry_out.h"
#include "hal/include/clock.h"

namespace plumb {

template <class Config>
class NavTask {
 public:
  /// All must outlive the task.
  NavTask(const Calibration& calibration, const Parameters& parameters, Tracker<Config::kMaxTracks>& tracker,
          SensorRings& rings, NavLink& link, Clock& clock, LogSink& log, TelemetrySink& telemetry)
      : rings_(rings),
        link_(link),
        clock_(clock),
        stages_(clock),
        job_(calibration, parameters, tracker, &stages_),
        out_(telemetry, log) {}

  /// Waits for an order, at most kLongestWait, and works off what is there.
  void run_once() {
    clock_.wait_until(clock_.now() + kLongestWait);
    // By reference: an order is large, and its place in the queue is not needed before it is done.
    while (const NavOrder* order = link_.orders.front()) {
      execute(*order);
      link_.orders.drop();
    }
  }

  const NavJob<Config>& job() const { return job_; }

 private:
  static constexpr Duration kLongestWait = Duration::from_ms(100);

  void execute(const NavOrder& order) {
    const Time start = clock_.now();
    if (kFlightSchedule[kJobHealth].due_in(order.input.tick)) {
      if (const ParamDamage found = job_.check_parameters(); found != ParamDamage::kNone) damage_ = found;
    }
    if (order.has_image) {
      slot_ = order.image.slot;
      t_start_ = start;
    }
    stages_.clear();
    const ImageView image = order.image.view(rings_.pixels[order.image.slot].data());
    const ImageOutcome& outcome = job_.step(order.input, order.has_image ? &image : nullptr);
    if (!outcome.processed && !outcome.refused) return;
    const Time end = clock_.now();
    const NavAnswer answer{.has_state = outcome.processed,
                           .slot = slot_,
                           .result = job_.result(),
                           .damage = std::exchange(damage_, ParamDamage::kNone),
                           .t_start = t_start_,
                           .t_end = end};
    if (outcome.processed) report(end - start);
    const Status answered = link_.answers.push(answer);
    PLUMB_ASSERT(ok(answered));  // the gate sends no image before it has the answer to the last one
  }

  // Before the answer, so that the log has a state before the frame that releases it.
  void report(Duration step) {
    const NavStateRecord record = job_.record();
    const TimingRecord timing{
        .t_image = record.t_image, .sequence = record.sequence, .stage_ns = stages_.stage_ns(), .step_ns = step.ns()};
    out_.send(record.t_image, record);
    out_.send(record.t_image, timing);
  }

  SensorRings& rings_;
  NavLink& link_;
  Clock& clock_;
  StageTimer stages_;
  NavJob<Config> job_;
  TelemetryOut<Thread::kOwn> out_;
  ParamDamage damage_ = ParamDamage::kNone;  ///< that the tick task does not know of yet
  std::uint8_t slot_ = 0;                    ///< of the image that is not answered for yet
  Time t_start_;
};

}  // namespace plumb
