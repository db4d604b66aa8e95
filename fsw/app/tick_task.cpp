#include "fsw/app/tick_task.h"

#include <utility>

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
      tick_++, [this] { return clock_.now(); }, [this](std::size_t job) { run_job(job); },
      [this](const ScheduleFact& fact) { tell(fact); });
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
  out_.send(frame.t, frame);
  gate_.order();
  wake_nav_.wake();
}

void TickTask::predict() {
  if (gate_.frame().handover == Handover::kReleased) output_.correct(gate_.answer().result);
  output_.step(gate_.frame());
  rings_.mode.store(output_.mode(), std::memory_order_relaxed);
}

void TickTask::publish() {
  if (gate_.answered()) {
    const NavAnswer& answer = gate_.answer();
    dispatcher_.account(kJobNav, answer.t_start, answer.t_end, [this](const ScheduleFact& fact) { tell(fact); });
    tell_of_damage(1, answer.damage);
  }
  tell_of_gate();
  tell_of_devices();
  answer_commands();
  for (const Event& event : output_.events()) tell(event);
  for (const PredictedState& state : output_.predicted()) out_.send(state.t, state);
  const Time now = clock_.now();
  for (const Time t_arrival : gate_.arrivals()) imu_latency_.add(now - t_arrival);
}

void TickTask::answer_commands() {
  bool told = false;
  for (const Command& command : gate_.frame().commands) {
    if (command.is(CommandId::kTellParameters) && !std::exchange(told, true)) {
      out_.send(gate_.frame().t, params_record(parameters().active(), FlightConfig::kName));
    }
    out_.send(gate_.frame().t, CommandAck{.t = gate_.frame().t, .command = command});
  }
}

void TickTask::tell(const Event& event) { out_.send(event.t, event); }

void TickTask::tell(const ScheduleFact& fact) {
  const Job& job = kFlightSchedule[fact.job];
  const bool overrun = fact.kind == ScheduleFact::Kind::kOverrun;
  const Duration limit = overrun ? job.budget : kTickPeriod * job.period_ticks;
  tell({.id = overrun ? EventId::kJobOverrun : EventId::kJobSlip,
        .t = gate_.frame().t,
        .arguments = {fact.job, fact.time.ns(), limit.ns(), static_cast<std::int64_t>(fact.suppressed)}});
}

void TickTask::tell_of_gate() {
  const InputFrame& frame = gate_.frame();
  const GateCounters& counters = gate_.counters();
  const auto tell_some = [&](EventId id, Throttle& throttle, std::int64_t second, std::uint64_t third) {
    if (!throttle.admit(frame.t)) return;
    tell({.id = id,
          .t = frame.t,
          .arguments = {static_cast<std::int64_t>(frame.tick), second, static_cast<std::int64_t>(third),
                        static_cast<std::int64_t>(throttle.suppressed())}});
  };
  if (frame.handover == Handover::kLate) {
    tell_some(EventId::kResultLate, late_throttle_, static_cast<std::int64_t>(counters.results_late), 0);
  }
  if (frame.image_skipped) {
    tell_some(EventId::kImageSkipped, skipped_throttle_, frame.camera.sequence, counters.images_skipped);
  }
  if (frame.nav_missed) {
    tell_some(EventId::kNavMissed, missed_throttle_, static_cast<std::int64_t>(counters.nav_missed), 0);
  }
}

void TickTask::tell_of_devices() {
  DeviceFault fault;
  for (DeviceFaultRing* ring : {&rings_.imu_faults, &rings_.camera_faults, &rings_.range_faults, &rings_.log_faults}) {
    for (std::size_t i = 0; i < DeviceFaultRing::capacity() && ring->pop(fault); ++i) {
      tell({.id = EventId::kDeviceFault,
            .t = gate_.frame().t,
            .arguments = {static_cast<std::int64_t>(fault.device), fault.counter,
                          static_cast<std::int64_t>(fault.count.count), fault.count.value}});
    }
  }
}

void TickTask::tell_of_damage(std::int64_t whose, ParamDamage damage) {
  if (damage == ParamDamage::kNone) return;
  tell({.id = EventId::kParametersDamaged,
        .t = gate_.frame().t,
        .arguments = {whose, static_cast<std::int64_t>(damage), 0, 0}});
}

void TickTask::publish_health() {
  const Time t = gate_.frame().t;
  tell_of_damage(0, output_.check_parameters());
  HealthRecord health = output_.health(t, gate_.answer().result);
  health.system.ticks = tick_;
  out_.send(t, health);
  ScheduleRecord schedule;
  schedule.t = t;
  schedule.imu_latency = {.count = imu_latency_.count(),
                          .median = imu_latency_.permille(500),
                          .permille_999 = imu_latency_.permille(999),
                          .max = imu_latency_.max()};
  for (std::size_t job = 0; job < kFlightSchedule.size(); ++job) {
    const Status added = schedule.jobs.push_back(
        {.name = kFlightSchedule[job].name, .budget = kFlightSchedule[job].budget, .account = dispatcher_.of(job)});
    PLUMB_ASSERT(ok(added));
  }
  out_.send(t, schedule);
}

}  // namespace plumb
