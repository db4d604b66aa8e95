#pragma once
// The tick: 250 times a second, what has come in becomes an InputFrame, the output is carried on to now and published.

#include "fsw/app/flight_schedule.h"
#include "fsw/app/input_gate.h"
#include "fsw/app/output_stage.h"
#include "fsw/app/telemetry_out.h"
#include "fsw/schedule/dispatcher.h"
#include "fsw/schedule/latency_histogram.h"
#include "hal/include/clock.h"

namespace plumb {

/// When a tick is due. The IMU's own samples drive it, so that the newest sample is never a period old when it is used;
/// where they stop, time does.
class TickPacer {
 public:
  /// Samples that come in a burst are one tick.
  static constexpr Duration kShortest = kTickPeriod * 3 / 4;
  /// Without a sample for so long the tick comes without one.
  static constexpr Duration kLongest = kTickPeriod * 5 / 4;

  explicit TickPacer(Time start) : t_last_(start) {}

  bool due(Time now, bool has_sample) const {
    return now - t_last_ >= kLongest || (has_sample && now - t_last_ >= kShortest);
  }
  /// What to wait for, if nobody brings a sample before.
  Time next(bool has_sample) const { return t_last_ + (has_sample ? kShortest : kLongest); }
  void ticked(Time now) { t_last_ = now; }

 private:
  Time t_last_;
};

class TickTask {
 public:
  /// `wake_nav` is woken when there is an order. All must outlive the task.
  TickTask(const Parameters& parameters, SensorRings& rings, NavLink& link, Clock& clock, Clock& wake_nav, LogSink& log,
           TelemetrySink& telemetry)
      : rings_(rings),
        clock_(clock),
        wake_nav_(wake_nav),
        output_(parameters),
        gate_(rings, link, output_.parameters()),
        out_(telemetry, log),
        pacer_(clock.now()) {}

  /// Waits until a tick is due, at most kLongest, and runs it.
  void run_once();

  const InputGate& gate() const { return gate_; }
  const OutputPredictor& predictor() const { return output_.predictor(); }
  const ParameterStore& parameters() const { return output_.parameters(); }
  const JobAccount& account(FlightJob job) const { return dispatcher_.of(job); }
  /// From the arrival of each IMU sample until the output of its tick was handed to telemetry and log.
  const LatencyHistogram& imu_latency() const { return imu_latency_; }

 private:
  void run_job(std::size_t job);
  void assemble();
  void predict();
  void publish();
  void answer_commands();
  void publish_health();
  void tell(const Event& event);
  void tell(const ScheduleFact& fact);
  void tell_of_gate();
  void tell_of_devices();
  /// `whose`: of the tick 0, of the nav job 1.
  void tell_of_damage(std::int64_t whose, ParamDamage damage);

  SensorRings& rings_;
  Clock& clock_;
  Clock& wake_nav_;
  OutputStage output_;
  InputGate gate_;
  TelemetryOut<Thread::kTick> out_;
  Dispatcher<kFlightSchedule> dispatcher_;
  LatencyHistogram imu_latency_;
  TickPacer pacer_;
  std::uint64_t tick_ = 0;
  Throttle late_throttle_{JobAccount::kBurst, JobAccount::kToldPeriod};
  Throttle skipped_throttle_{JobAccount::kBurst, JobAccount::kToldPeriod};
  Throttle missed_throttle_{JobAccount::kBurst, JobAccount::kToldPeriod};
};

}  // namespace plumb
