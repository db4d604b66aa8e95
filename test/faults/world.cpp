#include "test/faults/world.h"

#include <stdexcept>

#include "process/log_file.h"
#include "test/faults/heap_meter.h"
#include "test/live/flight_program.h"

namespace plumb::faults {
namespace {

FlightSetup plane_flight_setup(RangeFinder range_finder) {
  const char* const device = range_finder == RangeFinder::kCan ? "can: vcan0" : "i2c: /dev/i2c-1\n  model: v3";
  std::vector<std::string> faults;
  FlightSetup setup = read_flight_config(
      "the fault matrix",
      test::flight_configuration("/dev/null", 20.0, "/flight.lcm", "socket: /camera", test::range_section(device)),
      faults);
  if (!faults.empty()) throw std::runtime_error(faults.front());
  return setup;
}

std::unique_ptr<LcmLogWriter> open_log(const std::filesystem::path& name, const FlightSetup& setup, Time t) {
  std::string error;
  std::unique_ptr<LcmLogWriter> file = LcmLogWriter::open(name.string(), error);
  if (file == nullptr || !ok(write_session(*file, setup, t))) throw std::runtime_error(error);
  return file;
}

}  // namespace

// Sizes of the queues as in the process.
World::World(const std::filesystem::path& log, RangeFinder range_finder)
    : flight_(1e-9 * static_cast<double>(kStart_ns)),
      imu_(flight_, kStart_ns),
      camera_(kStart_ns),
      range_(flight_, kStart_ns),
      lidar_lite_(flight_),
      observer_(flight_, 1e-9 * static_cast<double>(kStart_ns)),
      setup_(plane_flight_setup(range_finder)),
      clock_(*this, false),
      tick_clock_(*this, true),
      file_(open_log(log, setup_, flight_time())),
      imu_log_("imu", LogSizes::kDevice),
      range_log_("range", LogSizes::kDevice),
      camera_log_("camera", LogSizes::kImages),
      tick_log_("tick", LogSizes::kTick),
      nav_log_("nav", LogSizes::kNav),
      writer_(*file_, {&imu_log_.log, &range_log_.log, &camera_log_.log, &nav_log_.log}, tick_log_.log),
      rings_(std::make_unique<SensorRings>()),
      link_(std::make_unique<NavLink>()),
      imu_task_(imu_, setup_.imu.settings, *rings_, clock_, tick_clock_, imu_log_.log),
      camera_task_(camera_, setup_.camera, setup_.calibration.camera, *rings_, clock_, camera_log_.log),
      tick_(setup_.parameters, *rings_, *link_, tick_clock_, nav_clock_, tick_log_.log, observer_),
      tracker_(std::make_unique<FlightTracker<FlightConfig>>(setup_.calibration.camera, setup_.parameters.tracker)),
      slow_tracker_(*this, *tracker_),
      nav_(std::make_unique<NavTask<FlightConfig>>(setup_.calibration, setup_.parameters, slow_tracker_, *rings_,
                                                   *link_, nav_clock_, nav_log_.log, observer_)) {
  if (range_finder == RangeFinder::kCan) {
    can_range_task_.emplace(range_, setup_.range, *rings_, clock_, range_log_.log);
  } else {
    lidar_lite_task_.emplace(lidar_lite_, setup_.range.lidar_lite, *rings_, clock_, range_log_.log);
  }
}

World::~World() = default;

void World::WorldClock::wait_until(Time t) {
  if (!drives_) return;
  const TestScope scope;
  while (!woken_ && now() < t) world_.step();
  woken_ = false;
}

Status World::SlowTracker::track(const CameraFrame& frame, const MotionPrediction& motion,
                                 FeatureFrame<FlightConfig::kMaxTracks>& out) {
  world_.nav_clock_.set(world_.flight_time());
  return tracker_.track(frame, motion, out);
}

void World::fly(double length_s, std::vector<Action> actions) {
  actions_ = std::move(actions);
  fly_until(length_s);
  finish();
}

void World::fly_until(double t_s) {
  const std::int64_t t_end_ns = kStart_ns + Duration::from_seconds(t_s).ns();
  while (t_ns_ < t_end_ns) {
    if (host_.tick_hangs) {
      step();
    } else {
      const FlightScope scope;
      tick_.run_once();
    }
  }
}

void World::step() {
  t_ns_ += kStep_ns;
  const double t_s = 1e-9 * static_cast<double>(t_ns_ - kStart_ns);
  observer_.set_now(t_s);
  while (next_action_ < actions_.size() && actions_[next_action_].t_s <= t_s) actions_[next_action_++].act(*this);
  run_devices();
  run_nav(false);
  constexpr std::int64_t kDrainPeriod_ns = 10'000'000;
  if (!host_.log_hangs && t_ns_ - t_drained_ns_ >= kDrainPeriod_ns) {
    t_drained_ns_ = t_ns_;
    writer_.drain(flight_time());
  }
}

// Each thread runs as soon as there is something for it. That of the IMU is told that the line is silent after 20 ms.
void World::run_devices() {
  constexpr std::int64_t kReadTimeout_ns = 20'000'000;
  imu_.run_until(t_ns_, flight_time());
  camera_.run_until(t_ns_, flight_time());
  range_.run_until(t_ns_, flight_time());
  lidar_lite_.run_until(t_ns_, flight_time());
  while (!host_.imu_thread_hangs && (imu_.has_bytes() || t_ns_ - t_imu_read_ns_ >= kReadTimeout_ns)) {
    t_imu_read_ns_ = t_ns_;
    {
      const FlightScope scope;
      imu_task_.run_once();
    }
    if (imu_.faults.gone) break;
  }
  while (camera_.has_frame()) {
    const FlightScope scope;
    camera_task_.run_once();
  }
  while (can_range_task_ && range_.has_frame()) {
    const FlightScope scope;
    can_range_task_->run_once();
  }
  if (lidar_lite_task_) {  // whose driver finds nothing to do before its time
    const FlightScope scope;
    lidar_lite_task_->run_once();
  }
}

// Orders without an image take no time. One with an image is done when its time is over, in one go; those that came
// meanwhile follow.
void World::run_nav(bool at_once) {
  const NavOrder* order = link_->orders.front();
  if (order == nullptr) return;
  if (!nav_works_) {
    nav_works_ = true;
    t_nav_start_ = flight_time();
    t_nav_end_ns_ = t_ns_ + (order->has_image ? host_.nav_time_ns : 0);
  }
  if (!at_once && (host_.nav_hangs || t_ns_ < t_nav_end_ns_)) return;
  nav_works_ = false;
  nav_clock_.set(t_nav_start_);
  const FlightScope scope;
  nav_->run_once();
}

// In the direction of the data, as the process ends its threads.
void World::finish() {
  tick_.run_once();
  run_nav(true);
  writer_.drain(flight_time());
  if (!ok(file_->flush())) throw std::runtime_error("the log cannot be written");
  file_.reset();
}

void World::step_clock(std::int64_t step_ns) {
  clock_offset_ns_ += step_ns;
  observer_.set_clock_offset(clock_offset_ns_);
}

void World::send_command(std::span<const std::uint8_t> message) {
  Command command;
  if (ok(decode(message, command))) static_cast<void>(rings_->commands.push(command));
}

std::uint64_t World::inputs_lost() const {
  return rings_->imu.overflows() + rings_->range.overflows() + rings_->commands.overflows() +
         camera_task_.faults().back();
}

}  // namespace plumb::faults
