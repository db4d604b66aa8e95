#include "process/device_tasks.h"

#include <algorithm>

#include "fsw/telemetry/command_messages.h"

namespace plumb {
namespace {

// One thread counts, others look.
void count(std::atomic<std::uint64_t>& counter) {
  counter.store(counter.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
}

// What the driver finds wrong does not come to the task; of a camera that shows both, the task's value is told.
FaultCounter sum(const FaultCounter& driver, const FaultCounter& task) {
  return {driver + task, task.count > 0 ? task.value : driver.value};
}

struct NodeCondition {
  can_range::NodeHealth health = can_range::NodeHealth::kOk;
  can_range::NodeMode mode = can_range::NodeMode::kOperational;
};

// The less the navigation rests on, the worse.
NodeCondition condition_in(NavMode mode) {
  using can_range::NodeHealth;
  switch (mode) {
    case NavMode::kInitialising: return {.mode = can_range::NodeMode::kInitialization};
    case NavMode::kRangeVio: return {};
    case NavMode::kVio: return {.health = NodeHealth::kWarning};
    case NavMode::kInertial: return {.health = NodeHealth::kError};
    case NavMode::kFailed: return {.health = NodeHealth::kCritical};
  }
  return {.health = NodeHealth::kCritical};
}

}  // namespace

void ImuTask::run_once() {
  const Time now = clock_.now();
  const Status status = device_.poll(now, kReadTimeout, completed_);
  if (status == Status::kNotReady) port_.record_silence(now);
  state_.store(device_.protocol().state(), std::memory_order_relaxed);
  for (const ImuSample& sample : completed_) {
    static_cast<void>(rings_.imu.push({.sample = sample, .t_arrival = device_.arrived()}));  // a full ring counts
    count(samples_);
  }
  if (!completed_.empty()) wake_tick_.wake();
  away_.look(status == Status::kRejected, port_.last_error());
  report_.look(now, faults());
  if (status == Status::kRejected) clock_.wait_until(now + kDevicePause);
}

std::array<FaultCounter, kStim300Faults.size()> ImuTask::faults() const {
  const stim300::FramerCounters& line = device_.protocol().framer();
  const stim300::Counters& unit = device_.protocol().counters();
  return {line.checksum_errors,
          line.skipped_bytes,
          unit.duplicates,
          unit.unconfigured,
          unit.starting,
          unit.faulty,
          unit.stuck,
          unit.overloads,
          unit.unaligned,
          unit.out_of_order,
          unit.conditions,
          unit.missing,
          unit.slips,
          unit.restarts,
          device_.protocol().clock().corrections(),
          rings_.imu.overflows(),
          port_.reopens(),
          away_.counter()};
}

void LidarLiteTask::run_once() {
  const Time now = clock_.now();
  const Result<RangeSample> sample = device_.poll(now);
  if (sample) {
    static_cast<void>(rings_.range.push(*sample));
    count(samples_);
  }
  away_.look(bus_.is_gone(), bus_.last_error());
  report_.look(now, faults());
  clock_.wait_until(device_.wake());
}

std::array<FaultCounter, kLidarLiteFaults.size()> LidarLiteTask::faults() const {
  const lidar_lite::Counters& unit = device_.counters();
  const FaultCounter not_acknowledged(unit.not_acknowledged, bus_.last_error());
  return {unit.not_ready,           not_acknowledged,     unit.busy_timeouts, unit.stuck,
          unit.wrong_model,         unit.verify_failures, unit.resets,        unit.late,
          rings_.range.overflows(), away_.counter()};
}

CanRangeTask::CanRangeTask(CanSocket& socket, const RangeSetup& setup, SensorRings& rings, Clock& clock, LogSink& log)
    : socket_(socket, log), receiver_(socket_, setup.can), rings_(rings), clock_(clock) {
  if (setup.can.protocol == can_range::Protocol::kDronecan) node_status_.emplace(setup.node_status, clock.now());
}

void CanRangeTask::run_once() {
  if (!started_) started_ = ok(receiver_.start());
  if (node_status_) tell_status();
  report_.look(clock_.now(), faults());
  const Result<can_range::Reading> reading = receiver_.poll(kReceiveTimeout);
  const bool is_away = reading.status() == Status::kRejected && socket_.health().state == CanState::kDown;
  away_.look(is_away, socket_.last_error());
  if (reading) {
    static_cast<void>(rings_.range.push(reading->sample));
    count(samples_);
  } else if (is_away) {
    clock_.wait_until(clock_.now() + kDevicePause);
  }
}

// A status that the bus does not take is missed by the others, as it should be.
void CanRangeTask::tell_status() {
  const NodeCondition condition = condition_in(rings_.mode.load(std::memory_order_relaxed));
  const Result<CanFrame> due = node_status_->next(clock_.now(), condition.health, condition.mode);
  if (due && !ok(socket_.send(*due))) status_not_sent_.add(socket_.last_error());
}

std::array<FaultCounter, kCanRangeFaults.size()> CanRangeTask::faults() const {
  const can_range::TransferCounters& transfers = receiver_.decoder().transfer_counters();
  const CanHealth& bus = socket_.health();
  return {receiver_.decoder().counters().malformed,
          transfers.malformed,
          transfers.crc_errors,
          transfers.wrong_toggle,
          transfers.orphans,
          transfers.abandoned,
          transfers.duplicates,
          transfers.nodes_forgotten,
          bus.error_frames,
          bus.bus_offs,
          bus.restarts,
          bus.overflows,
          bus.stamps_mended,
          status_not_sent_,
          rings_.range.overflows(),
          transfers.missing,
          away_.counter()};
}

void CommandTask::run_once() {
  const Result<std::span<const std::uint8_t>> message = source_.receive(kReceiveTimeout);
  if (message.status() == Status::kRejected) {
    failures_.add(source_.last_error());
    clock_.wait_until(clock_.now() + kDevicePause);
  }
  if (!message) return;
  Command command;
  if (ok(decode(*message, command))) {
    static_cast<void>(rings_.commands.push(command));  // a full ring counts
  } else {
    ++not_commands_;
  }
}

CameraTask::CameraTask(CameraPort& port, const CameraSetup& setup, const CameraCalibration& calibration,
                       SensorRings& rings, Clock& clock, LogSink& log)
    : port_(port),
      setup_(setup),
      width_(calibration.width),
      height_(calibration.height),
      rings_(rings),
      clock_(clock),
      log_(log),
      message_(kImageHeaderBytes + static_cast<std::size_t>(calibration.width) * calibration.height) {
  if (!setup.is_ov7251) return;
  ov7251::Options options;
  options.period = Duration::from_seconds(1.0 / setup.rate_hz);
  options.arrival_delay = setup.latency;
  options.trigger = setup.trigger;
  options.longest_exposure = setup.longest_exposure;
  options.brightness.target = setup.target_brightness;
  if (setup.exposure > Duration()) {
    options.auto_exposure = false;
    options.exposure.time = setup.exposure;
    options.longest_exposure = setup.exposure;  // else what is longer would become gain
  }
  ov7251_.emplace(port, options);
}

void CameraTask::run_once() {
  if (!started_) started_ = start() != Status::kInvalidValue;  // a camera that is away comes back by itself
  const std::uint32_t received = port_.health().received;
  const Result<CameraFrame> frame = next_frame();
  // The sensor's driver rejects images too.
  const bool is_away = frame.status() == Status::kRejected && port_.health().received == received;
  away_.look(is_away, port_.last_error());
  report_.look(clock_.now(), faults());
  if (frame) {
    accept(*frame);
  } else if (is_away) {
    clock_.wait_until(clock_.now() + kDevicePause);
  }
}

Status CameraTask::start() {
  if (ov7251_) return ov7251_->start();
  return port_
      .start({.width = width_,
              .height = height_,
              .period = Duration::from_seconds(1.0 / setup_.rate_hz),
              .trigger = setup_.trigger})
      .status();
}

Result<CameraFrame> CameraTask::next_frame() {
  if (ov7251_) return ov7251_->poll(clock_.now(), kReceiveTimeout);
  const Result<PortFrame> frame = port_.receive(kReceiveTimeout);
  if (!frame) return frame.status();
  if (frame->damaged) return Status::kNotReady;  // the port has counted it
  return CameraFrame{.t_exposure_mid = mid_exposure(*frame), .sequence = frame->sequence, .image = frame->image};
}

std::array<FaultCounter, kCameraFaults.size()> CameraTask::faults() const {
  const CameraHealth& port = port_.health();
  // The driver of the sensor looks closer than the port.
  const ov7251::Counters sensor = ov7251_ ? ov7251_->protocol().counters() : ov7251::Counters{};
  return {port.damaged,
          port.malformed,
          sum(sensor.wrong_size, counters_.wrong_size),
          sum(sensor.repeated, counters_.repeated),
          ov7251_ ? sensor.lost : port.missed,
          ov7251_ ? sensor.out_of_order : port.out_of_order,
          port.stamps_mended,
          port.restarts,
          sensor.refused,
          counters_.no_slot,
          away_.counter()};
}

void CameraTask::accept(const CameraFrame& frame) {
  if (frame.image.width != width_ || frame.image.height != height_) {
    counters_.wrong_size.add(value_pair(frame.image.width, frame.image.height));
    return;
  }
  if (is_repeated(frame)) {
    counters_.repeated.add(frame.sequence);
    return;
  }
  if (!has_slot_) has_slot_ = rings_.empty.pop(slot_);
  if (!has_slot_) {
    counters_.no_slot.add(frame.sequence);
    return;
  }
  const StoredImage stored{
      .reference = {.t_exposure_mid = frame.t_exposure_mid + setup_.shift, .sequence = sequence_++},
      .slot = slot_,
      .width = width_,
      .height = height_};
  std::uint8_t* to = rings_.pixels[slot_].data();
  for (std::int32_t row = 0; row < height_; ++row) {
    to = std::copy_n(frame.image.pixels + static_cast<std::ptrdiff_t>(row) * frame.image.stride, width_, to);
  }
  const CameraFrame logged{.t_exposure_mid = stored.reference.t_exposure_mid,
                           .sequence = stored.reference.sequence,
                           .image = stored.view(rings_.pixels[slot_].data())};
  const Result<std::size_t> size = encode(logged, MessageBuffer(message_));
  t_last_ = frame.t_exposure_mid;
  static_cast<void>(log_.write(channel::kCamera, clock_.now(), MessageBytes(message_.data(), size.value())));
  has_slot_ = !ok(rings_.images.push(stored));
  count(images_);
}

bool CameraTask::is_repeated(const CameraFrame& frame) const {
  if (t_last_ == Time::never()) return false;
  if (frame.t_exposure_mid == t_last_) return true;
  const std::uint8_t* before = message_.data() + kImageHeaderBytes;
  const std::uint8_t first = *frame.image.pixels;
  bool flat = true;
  for (std::int32_t row = 0; row < height_; ++row, before += width_) {
    const std::uint8_t* const now = frame.image.pixels + static_cast<std::ptrdiff_t>(row) * frame.image.stride;
    if (!std::equal(now, now + width_, before)) return false;
    flat = flat && std::all_of(now, now + width_, [first](std::uint8_t pixel) { return pixel == first; });
  }
  return !flat;
}

Time CameraTask::mid_exposure(const PortFrame& frame) const {
  const Duration exposure = frame.has_exposure ? frame.exposure.time : setup_.exposure;
  switch (frame.stamp) {
    case CameraStamp::kStartOfExposure: return frame.t + exposure / 2;
    case CameraStamp::kEndOfFrame: return frame.t - setup_.readout - exposure / 2;
    case CameraStamp::kArrival: return frame.t - setup_.latency - setup_.readout - exposure / 2;
    case CameraStamp::kEndOfExposure: return frame.t - exposure / 2;
  }
  return frame.t;
}

}  // namespace plumb
