#include "drivers/lidar_lite/protocol.h"

#include <algorithm>

namespace plumb::lidar_lite {

Protocol::Protocol(const Options& options)
    : options_(options), table_(table_of(options.model)), capture_(options.model) {
  PLUMB_ASSERT(options.period >= kMinPeriod);
  PLUMB_ASSERT(options.bias_period >= 1 && options.bias_period <= kMaxBiasPeriod);
}

void Protocol::go(Step step, Time wake) {
  step_ = step;
  wake_ = wake;
  pointer_written_ = false;
}

void Protocol::reset_device(Time now) {
  const Duration pause = back_off_ == 0 ? Duration() : kResetPause * (std::int64_t{1} << (back_off_ - 1));
  back_off_ = std::min(back_off_ + 1, kMaxBackOff);
  failures_in_a_row_ = 0;
  zeros_in_a_row_ = 0;
  t_schedule_ = Time::never();
  go(Step::kReset, now + pause);
}

Request Protocol::read_register(std::uint8_t address, std::uint8_t size) {
  Request request;
  if (pointer_written_) {
    request.kind = Request::Kind::kRead;
    request.size = size;
    return request;
  }
  request.kind = Request::Kind::kWrite;
  (void)request.bytes.push_back(address);
  return request;
}

void Protocol::start_measurement(Time now) {
  // Due one period after the last was due, so that the rate is kept; what cannot be made up for is left out.
  const bool first = t_schedule_ == Time::never();
  t_schedule_ = t_schedule_ + options_.period;
  if (now - t_schedule_ < options_.period) return;
  if (!first) counters_.late.add((now - t_schedule_).ns());
  t_schedule_ = now;
}

Request Protocol::next(Time now) {
  if (now < wake_) return {};
  if (step_ > Step::kCommand && now - t_command_ > kMaxAcquisition) {
    counters_.busy_timeouts.add(status_);
    reset_device(now);
    if (now < wake_) return {};
  }
  const auto write = [](std::uint8_t address, std::uint8_t value) {
    Request request;
    request.kind = Request::Kind::kWrite;
    (void)request.bytes.push_back(address);
    (void)request.bytes.push_back(value);
    return request;
  };
  switch (step_) {
    case Step::kReset: return write(kRegisterCommand, kCommandReset);
    case Step::kIdentity: return read_register(table_.identity_register, 1);
    case Step::kPreset: return write(table_.preset[preset_index_].address, table_.preset[preset_index_].value);
    case Step::kVerify: return read_register(table_.preset.front().address, 1);
    case Step::kCommand: {
      const bool bias = commands_ % static_cast<std::uint64_t>(options_.bias_period) == 0;
      return write(kRegisterCommand, bias ? table_.command_bias : table_.command_plain);
    }
    case Step::kStatus: return read_register(kRegisterStatus, 1);
    case Step::kDistance: return read_register(table_.distance_register, 2);
    case Step::kStrength: return read_register(table_.strength_register, 1);
  }
  return {};
}

Result<RangeSample> Protocol::complete(const Transfer& transfer) {
  const Result<Measurement> measured = capture_.decode(transfer);
  if (!transfer.acknowledged) {
    on_failure(transfer.t_stop);
    return Status::kNotReady;
  }
  failures_in_a_row_ = 0;
  if (measured) return on_measurement(*measured, transfer.t_stop);
  if (!transfer.is_read && transfer.bytes.size() == 1) {
    pointer_written_ = true;
  } else if (!transfer.is_read) {
    on_written(transfer.t_stop);
  } else if (step_ > Step::kCommand) {
    on_measurement_read(transfer);
  } else {
    on_read(transfer);
  }
  return Status::kNotReady;
}

void Protocol::on_failure(Time t) {
  ++counters_.not_acknowledged;
  pointer_written_ = false;
  if (step_ == Step::kReset) {  // nobody there
    reset_device(t);
    return;
  }
  wake_ = t + kPollPeriod;
  // Older units refuse while they are busy; the limit of the acquisition ends that.
  if (step_ == Step::kStatus) return;
  if (++failures_in_a_row_ >= kMaxFailuresInARow) reset_device(t);
}

void Protocol::on_written(Time t) {
  if (step_ == Step::kReset) {
    ++counters_.resets;
    go(Step::kIdentity, t + kResetPause);
  } else if (step_ == Step::kPreset) {
    const bool done = ++preset_index_ == table_.preset.size();
    go(done ? Step::kVerify : Step::kPreset, t);
  } else if (step_ == Step::kCommand) {
    start_measurement(t);
    ++commands_;
    t_command_ = t;
    go(Step::kStatus, t + kPollPeriod);
  }
}

void Protocol::on_read(const Transfer& transfer) {
  const Time t = transfer.t_stop;
  const std::uint8_t value = transfer.bytes.empty() ? 0 : transfer.bytes[0];
  if (step_ == Step::kIdentity) {
    if (table_.is_identity(value)) {
      preset_index_ = 0;
      go(Step::kPreset, t);
      return;
    }
    counters_.wrong_model.add(value);
  } else if (step_ == Step::kVerify) {
    if (value == table_.preset.front().value) {
      go(Step::kCommand, t);
      return;
    }
    counters_.verify_failures.add(value);
  }
  reset_device(t);
}

void Protocol::on_measurement_read(const Transfer& transfer) {
  const Time t = transfer.t_stop;
  if (step_ == Step::kStatus) {
    if (!transfer.bytes.empty()) status_ = transfer.bytes[0];
    const bool busy = transfer.bytes.empty() || (status_ & kStatusBusy) != 0;
    go(busy ? Step::kStatus : Step::kDistance, busy ? t + kPollPeriod : t);
  } else if (step_ == Step::kDistance) {
    go(Step::kStrength, t);
  }
}

Result<RangeSample> Protocol::on_measurement(const Measurement& measurement, Time now) {
  go(Step::kCommand, std::max(now, t_schedule_ + options_.period));
  const Interpreted& interpreted = measurement.interpreted;
  const bool useless = interpreted.verdict == Verdict::kNoReading || interpreted.distance_cm == 0;
  if (useless) {
    if (++zeros_in_a_row_ >= kMaxZerosInARow) {
      counters_.stuck.add(interpreted.distance_cm);
      reset_device(now);
    }
  } else {
    zeros_in_a_row_ = 0;
    back_off_ = 0;
  }
  switch (interpreted.verdict) {
    case Verdict::kRange: ++counters_.ranges; break;
    case Verdict::kNoReturn: ++counters_.no_returns; break;
    case Verdict::kWeak: ++counters_.weak; break;
    case Verdict::kNoReading: counters_.not_ready.add(interpreted.distance_cm); return Status::kNotReady;
  }
  return to_sample(interpreted, measurement.t);
}

}  // namespace plumb::lidar_lite
