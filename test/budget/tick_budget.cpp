// Flies a recording through the tick and the nav task in turn, a tick for each IMU sample as in flight, with marks
// around the ticks and the jobs of the schedule, for tick_budget.py to count what each costs.
//
//   plumb-tick-budget RECORDING [IMAGES]
//
// Prints the names of the jobs, and on a line each the numbers of the ticks with which the running filter processed an
// image.

#include <algorithm>
#include <array>
#include <cstdio>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "fsw/app/nav_task.h"
#include "fsw/app/tick_task.h"
#include "fsw/vision/flight_tracker.h"
#include "hal/include/no_sink.h"
#include "hal/include/queued_log.h"
#include "test/budget/budget_program.h"
#include "test/budget/instruction_mark.h"
#include "test/support/standing_clock.h"
#include "tools/replay/asl_reader.h"

namespace plumb::budget {
namespace {

/// The region of a job, in the order of the schedule.
constexpr std::uint8_t job_region(FlightJob job) {
  return static_cast<std::uint8_t>(static_cast<std::size_t>(Region::kJobs) + job);
}
constexpr std::uint8_t begin_of(FlightJob job) { return begin_tag(job_region(job)); }
constexpr std::uint8_t end_of(FlightJob job) { return end_tag(job_region(job)); }
static_assert(job_region(static_cast<FlightJob>(kFlightSchedule.size())) <= static_cast<std::uint8_t>(Region::kImage));

/// The clock of the tick, which is asked when a job begins and when it ends: it marks both. What a job asks for itself
/// is no mark.
class JobClock final : public test::StandingClock {
 public:
  Time now() const override {
    if (asked_ < kMarks.size() && kMarks[asked_] != kNoMark) mark(kMarks[asked_]);
    ++asked_;
    return StandingClock::now();
  }
  void begin_tick() { asked_ = 0; }
  /// Throws when the clock was asked otherwise than the marks stand for.
  void end_tick(std::uint64_t tick) const {
    const std::size_t expected = kFlightSchedule[kJobHealth].due_in(tick) ? kMarks.size() : kMarks.size() - 2;
    if (asked_ != expected) {
      throw std::runtime_error("tick " + std::to_string(tick) + " asked the clock " + std::to_string(asked_) +
                               " times; expected " + std::to_string(expected) + ", as in JobClock::kMarks");
    }
  }

 private:
  static constexpr std::uint8_t kNoMark = 0xFF;
  static constexpr std::array<std::uint8_t, 11> kMarks = {kNoMark,  // whether a tick is due
                                                          begin_of(kJobAssemble),
                                                          kNoMark,
                                                          end_of(kJobAssemble),  // the frame's own time
                                                          begin_of(kJobPredict),
                                                          end_of(kJobPredict),
                                                          begin_of(kJobPublish),
                                                          kNoMark,
                                                          end_of(kJobPublish),  // the latency of the samples
                                                          begin_of(kJobHealth),
                                                          end_of(kJobHealth)};
  mutable std::size_t asked_ = 0;
};

class TickFlight {
 public:
  explicit TickFlight(const replay::Session& session)
      : storage_(std::size_t{1} << 20),
        room_(kMaxMessageBytes),
        log_("tick", storage_),
        tracker_(session.calibration.camera, session.parameters.tracker),
        tick_(session.parameters, rings_, link_, clock_, nav_clock_, log_, telemetry_),
        nav_(session.calibration, session.parameters, tracker_, rings_, link_, nav_clock_, log_, telemetry_) {}

  void fly(const replay::Tick& recorded) {
    for (std::size_t i = 0; i < recorded.input.imu.size(); ++i) {
      const ImuSample& sample = recorded.input.imu[i];
      const bool last = i + 1 == recorded.input.imu.size();
      if (last) bring(recorded);
      clock_.set(sample.t);
      nav_clock_.set(sample.t);
      static_cast<void>(rings_.imu.push({.sample = sample, .t_arrival = sample.t}));
      clock_.begin_tick();
      {
        const RegionScope scope(Region::kTick);
        tick_.run_once();
      }
      clock_.end_tick(tick_.gate().frame().tick);
      const NavStateRecord before = nav_.job().record();
      {
        const RegionScope scope(Region{job_region(kJobNav)});
        nav_.run_once();
      }
      end(static_cast<std::uint8_t>(Region::kImage));
      if (before.state.valid && nav_.job().record().sequence != before.sequence) std::printf("%zu\n", ticks_);
      ++ticks_;
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
  JobClock clock_;
  test::StandingClock nav_clock_;
  NoSink telemetry_;  ///< beyond it begins the transport, which is not flight code
  SensorRings rings_;
  NavLink link_;
  FlightTracker<FlightConfig> tracker_;
  TickTask tick_;
  NavTask<FlightConfig> nav_;
  std::size_t ticks_ = 0;
};

int run(int argc, char** argv) {
  if (argc != 2 && argc != 3) {
    std::fprintf(stderr, "usage: %s RECORDING [IMAGES]\n", argv[0]);
    return 2;
  }
  const std::size_t images = images_wanted(argc, argv, 2);
  for (const Job& job : kFlightSchedule) std::printf("%s ", std::string(job.name).c_str());
  std::printf("\n");
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
