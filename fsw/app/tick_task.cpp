#include "fsw/app/tick_task.h"

namespace plumb {

void TickTask::run_once() {
  Time now = clock_.now();
  constexpr int kMaxWakes = 256;  // each by a sample of a device, or a signal
  for (int i = 0; i < kMaxWakes && !pacer_.due(now, rings_.imu.size() > 0); ++i) {
    clock_.wait_until(pacer_.next(rings_.imu.size() > 0));
    now = clock_.now();
  }
  pacer_.ticked(now);
  dispatcher_.dispatch(
      tick_++, [this] { return clock_.now(); }, [this](std::size_t job) { run_job(job); }, [](const ScheduleFact&) {});
}

void TickTask::run_job(std::size_t job) {
  switch (job) {
    case kJobAssemble: assemble(); break;
    case kJobPredict: predict(); break;
    case kJobPublish: publish(); break;
    case kJobHealth: publish_health(); break;
    default: PLUMB_ASSERT(false);  // the nav job is not of the tick
  }
}

void TickTask::assemble() {
  const InputFrame& frame = gate_.assemble(clock_.now());
  log_.write(channel::kInputFrame, frame.t, frame);
  gate_.order();
  wake_nav_.wake();
}

void TickTask::predict() {
  if (gate_.frame().handover == Handover::kReleased) output_.correct(gate_.answer().state);
  output_.step(gate_.frame());
}

void TickTask::publish() {
  if (gate_.answered()) {
    const NavAnswer& answer = gate_.answer();
    dispatcher_.account(kJobNav, answer.t_start, answer.t_end, [](const ScheduleFact&) {});
  }
  for (const PredictedState& state : output_.predicted()) {
    publisher_.publish(channel::kNavOutput, state);
    log_.write(channel::kNavOutput, state.t, state);
  }
}

void TickTask::publish_health() {
  const NavAnswer& answer = gate_.answer();
  const Time t = gate_.frame().t;
  HealthRecord health{.t = t,
                      .estimator = answer.estimator,
                      .system = answer.system,
                      .predictor = output_.predictor().counters(),
                      .tracking = output_.predictor().tracking(),
                      .calibration = answer.calibration,
                      .pixel_noise_px = answer.pixel_noise_px};
  health.system.ticks = tick_;
  publisher_.publish(channel::kNavHealth, health);
  log_.write(channel::kNavHealth, t, health);
  ScheduleRecord schedule;
  schedule.t = t;
  for (std::size_t job = 0; job < kFlightSchedule.size(); ++job) {
    const Status added = schedule.jobs.push_back(
        {.name = kFlightSchedule[job].name, .budget = kFlightSchedule[job].budget, .account = dispatcher_.of(job)});
    PLUMB_ASSERT(ok(added));
  }
  publisher_.publish(channel::kSchedule, schedule);
  log_.write(channel::kSchedule, t, schedule);
}

}  // namespace plumb
