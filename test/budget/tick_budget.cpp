// Flies a recording through the tick and the nav task in turn, a tick for each IMU sample as in flight, with marks
// around the ticks, for tick_budget.py to count what one costs.
//
//   plumb-tick-budget RECORDING [IMAGES]

#include <algorithm>
#include <cstdio>
#include <memory>
#include <vector>

#include "fsw/app/nav_task.h"
#include "fsw/app/tick_task.h"
#include "fsw/vision/flight_tracker.h"
#include "hal/include/queued_log.h"
#include "test/budget/budget_program.h"
#include "test/budget/instruction_mark.h"
#include "tools/replay/asl_reader.h"

namespace plumb::budget {
namespace {

/// Stands where it is put; nobody waits.
class StandingClock final : public Clock {
 public:
  Time now() const override { return now_; }
  void wait_until(Time) override {}
  void wake() override {}
  void set(Time t) { now_ = t; }

 private:
  Time now_;
};

/// Beyond it begins the transport, which is not flight code.
class NoTelemetry final : public TelemetrySink {
 public:
  Status publish(const char*, std::span<const std::uint8_t>) override { return Status::kOk; }
};

class TickFlight {
 public:
  explicit TickFlight(const replay::Session& session)
      : storage_(std::size_t{1} << 20),
        room_(kMaxMessageBytes),
        log_("tick", storage_),
        tracker_(session.calibration.camera, session.parameters.tracker),
        tick_(session.parameters, rings_, link_, clock_, clock_, log_, telemetry_),
        nav_(session.calibration, session.parameters, tracker_, rings_, link_, clock_, log_, telemetry_) {}

  void fly(const replay::Tick& recorded) {
    for (std::size_t i = 0; i < recorded.input.imu.size(); ++i) {
      const ImuSample& sample = recorded.input.imu[i];
      const bool last = i + 1 == recorded.input.imu.size();
      if (last) bring(recorded);
      clock_.set(sample.t);
      static_cast<void>(rings_.imu.push({.sample = sample, .t_arrival = sample.t}));
      {
        const RegionScope scope(Region::kTick);
        tick_.run_once();
      }
      end(static_cast<std::uint8_t>(Region::kImage));
      nav_.run_once();
      empty_log();
    }
  }

 private:
  void bring(const replay::Tick& recorded) {
    for (const RangeSample& range : recorded.input.range) static_cast<void>(rings_.range.push(range));
    std::uint8_t slot = 0;
    if (!recorded.input.has_camera || !rings_.empty.pop(slot)) return;
    const ImageView& image = recorded.image;
    std::uint8_t* to = rings_.pixels[slot].data();
    for (std::int32_t row = 0; row < image.height; ++row) {
      to = std::copy_n(image.pixels + static_cast<std::ptrdiff_t>(row) * image.stride, image.width, to);
    }
    static_cast<void>(rings_.images.push(
        {.reference = recorded.input.camera, .slot = slot, .width = image.width, .height = image.height}));
  }
  void empty_log() {
    RecordRing::Record record;
    while (log_.ring().pop(log_.ring().written(), room_, record)) {
    }
  }

  std::vector<std::uint8_t> storage_;
  std::vector<std::uint8_t> room_;
  QueuedLog log_;
  StandingClock clock_;
  NoTelemetry telemetry_;
  SensorRings rings_;
  NavLink link_;
  FlightTracker<FlightConfig> tracker_;
  TickTask tick_;
  NavTask<FlightConfig> nav_;
};

int run(int argc, char** argv) {
  if (argc != 2 && argc != 3) {
    std::fprintf(stderr, "usage: %s RECORDING [IMAGES]\n", argv[0]);
    return 2;
  }
  const std::size_t images = images_wanted(argc, argv, 2);
  const auto source = replay::open_asl({.folder = argv[1], .parameters = {}});
  const auto flight = std::make_unique<TickFlight>(source->session());
  replay::Tick tick;
  for (std::size_t done = 0; done < images && source->next(tick); done += tick.input.has_camera ? 1 : 0) {
    flight->fly(tick);
  }
  return 0;
}

}  // namespace
}  // namespace plumb::budget

int main(int argc, char** argv) { return plumb::budget::exit_code_of(plumb::budget::run, argc, argv); }
