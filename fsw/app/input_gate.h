#pragma once
// The one gate into the flight software, live: what the device threads have left in their rings, and what the timing of
// the nav job makes of this tick, become one InputFrame. Nothing that is decided here is decided again in a replay.

#include "fsw/app/command_judge.h"
#include "fsw/app/nav_link.h"
#include "fsw/app/sensor_rings.h"

namespace plumb {

struct GateCounters {
  std::uint64_t images_skipped = 0;  ///< the nav job was busy, and another image waited or this one had waited too long
  std::uint64_t results_late = 0;    ///< not there when their logical execution time was over
  std::uint64_t nav_missed = 0;      ///< frames that the nav job never got, because its queue was full
};

class InputGate {
 public:
  /// A waiting image that is this much older than the next one gives way to it: the IMU is gone, or the nav job hangs.
  static constexpr Duration kMaxImageWait = Duration::from_ms(200);

  /// All must outlive the gate. `parameters`: those in force, which have to fit what a command sets.
  InputGate(SensorRings& rings, NavLink& link, const ParameterStore& parameters)
      : rings_(rings), link_(link), parameters_(parameters) {}

  /// The frame of the next tick, which ends at `now` on the flight clock.
  const InputFrame& assemble(Time now);
  /// Hands the assembled frame to the nav job, once it is logged.
  void order();

  const InputFrame& frame() const { return frame_; }
  using Arrivals = FixedVector<Time, kMaxImuPerFrame>;
  /// When each IMU sample of the frame came. Of the machine, so no part of the frame.
  const Arrivals& arrivals() const { return arrivals_; }
  /// Of the newest result that came back. Its state is in force from the tick whose handover is kReleased.
  const NavAnswer& answer() const { return answer_; }
  /// Whether the answer came in this tick.
  bool answered() const { return answered_; }
  const GateCounters& counters() const { return counters_; }

 private:
  void decide_handover();
  void take_samples();
  void take_commands();
  void choose_image();
  void send(const StoredImage& image);
  void skip(const StoredImage& image);
  bool can_process(const StoredImage& image) const {
    return !busy_ && !frame_.nav_missed && newest_imu_ >= image.reference.t_exposure_mid;
  }

  SensorRings& rings_;
  NavLink& link_;
  const ParameterStore& parameters_;
  InputFrame frame_;
  Arrivals arrivals_;
  std::uint64_t next_tick_ = 0;
  Time newest_imu_ = Time::never();
  bool busy_ = false;  ///< an image is with the nav job, or its result is not released yet
  bool has_result_ = false;
  bool answered_ = false;
  std::uint64_t due_tick_ = 0;  ///< of the result
  NavAnswer answer_;
  bool waiting_ = false;
  StoredImage waiting_image_;
  bool sends_image_ = false;
  StoredImage sent_image_;
  CommandJudge judge_;
  Parameters staged_;  ///< what the commands of a frame make of the parameters
  GateCounters counters_;
};

}  // namespace plumb
