#include "fsw/app/input_gate.h"

#include <algorithm>

#include "fsw/app/flight_schedule.h"

namespace plumb {

const InputFrame& InputGate::assemble(Time now) {
  frame_.tick = next_tick_++;
  // A clock that stands still for a tick is no reason to lose it.
  frame_.t = std::max(now, frame_.t + Duration::from_ns(1));
  frame_.has_camera = false;
  frame_.camera = {};
  frame_.image_skipped = false;
  frame_.nav_missed = link_.orders.full();
  if (frame_.nav_missed) ++counters_.nav_missed;
  sends_image_ = false;
  decide_handover();
  take_samples();
  take_commands();
  choose_image();
  return frame_;
}

// The result of an image counts from a fixed number of ticks after the image was handed over. What is there sooner
// waits; what is there later is released when it comes, and the frame says so.
void InputGate::decide_handover() {
  frame_.handover = Handover::kHeld;
  answered_ = false;
  if (!busy_) return;
  if (!has_result_ && link_.answers.pop(answer_)) {
    answered_ = true;
    const Status returned = rings_.empty.push(answer_.slot);
    PLUMB_ASSERT(ok(returned));  // there are no more slots than the ring has room for
    busy_ = answer_.has_state;
    has_result_ = answer_.has_state;
  }
  if (!busy_ || frame_.tick < due_tick_) return;
  if (has_result_) {
    frame_.handover = Handover::kReleased;
    has_result_ = false;
    busy_ = false;
  } else if (frame_.tick == due_tick_) {
    frame_.handover = Handover::kLate;
    ++counters_.results_late;
  }
}

// More than a frame holds stays in the ring for the next tick.
void InputGate::take_samples() {
  frame_.imu.clear();
  arrivals_.clear();
  ReceivedImu imu;
  while (!frame_.imu.full() && rings_.imu.pop(imu)) {
    static_cast<void>(frame_.imu.push_back(imu.sample));
    static_cast<void>(arrivals_.push_back(imu.t_arrival));
    newest_imu_ = imu.sample.t;
  }
  frame_.range.clear();
  RangeSample range;
  while (!frame_.range.full() && rings_.range.pop(range)) static_cast<void>(frame_.range.push_back(range));
}

// A command waits for a frame that the nav job gets.
void InputGate::take_commands() {
  frame_.commands.clear();
  Command command;
  while (!frame_.nav_missed && !frame_.commands.full() && rings_.commands.pop(command)) {
    if (frame_.commands.empty()) staged_ = parameters_.active();
    judge_.judge(command, staged_);
    static_cast<void>(frame_.commands.push_back(command));
  }
}

// One image waits, for the IMU to reach it and for the nav job to be free. Waiting here instead of being skipped at
// once, a camera whose period is hardly longer than the logical execution time loses no image to jitter.
void InputGate::choose_image() {
  if (waiting_ && can_process(waiting_image_)) {
    waiting_ = false;
    send(waiting_image_);
    return;
  }
  StoredImage next;
  if (!rings_.images.pop(next)) return;
  // Waiting for its time to come, one wrong stamp would keep all others out for as long as it is ahead.
  if (next.reference.t_exposure_mid > frame_.t) {
    skip(next);
  } else if (!waiting_) {
    if (can_process(next)) {
      send(next);
    } else {
      waiting_ = true;
      waiting_image_ = next;
    }
  } else if (next.reference.t_exposure_mid - waiting_image_.reference.t_exposure_mid > kMaxImageWait) {
    skip(waiting_image_);
    waiting_image_ = next;
  } else {
    skip(next);
  }
}

void InputGate::send(const StoredImage& image) {
  frame_.has_camera = true;
  frame_.camera = image.reference;
  sends_image_ = true;
  sent_image_ = image;
  busy_ = true;
  due_tick_ = frame_.tick + kFlightSchedule[kJobNav].logical_ticks;
}

void InputGate::skip(const StoredImage& image) {
  frame_.has_camera = true;
  frame_.camera = image.reference;
  frame_.image_skipped = true;
  ++counters_.images_skipped;
  const Status returned = rings_.empty.push(image.slot);
  PLUMB_ASSERT(ok(returned));
}

void InputGate::order() {
  if (frame_.nav_missed) return;
  const Status ordered = link_.orders.push({.input = frame_, .has_image = sends_image_, .image = sent_image_});
  PLUMB_ASSERT(ok(ordered));  // this thread alone adds to the queue, and it was not full
}

}  // namespace plumb
