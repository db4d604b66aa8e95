#pragma once
// The tasks of plumb-fsw with the plane flight's devices, in one thread and on a simulated clock: what runs when is
// exact, so a fault strikes at the same byte in every run. The gate, the tick, the nav job, the device tasks, the
// drivers, the log's writer and its file are those that fly; the clock, the lines and who runs when are simulated.

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "fsw/app/nav_task.h"
#include "fsw/app/tick_task.h"
#include "fsw/vision/flight_tracker.h"
#include "hal/linux/lcm_log.h"
#include "hal/linux/log_writer.h"
#include "process/device_tasks.h"
#include "process/thread_log.h"
#include "test/faults/devices.h"
#include "test/faults/observer.h"
#include "test/support/standing_clock.h"

namespace plumb::faults {

/// What goes wrong with the computer.
struct HostFaults {
  std::int64_t nav_time_ns = 10'000'000;  ///< that an image takes
  bool imu_thread_hangs = false;
  bool tick_hangs = false;
  bool nav_hangs = false;
  bool log_hangs = false;  ///< the disk does not answer
};

class World;

/// Which range finder the vehicle has.
enum class RangeFinder : std::uint8_t { kCan, kLidarLite };

/// What is done to the world at a time since the flight began.
struct Action {
  double t_s = 0.0;
  std::function<void(World&)> act;
};

class World {
 public:
  /// The log goes to `log`.
  explicit World(const std::filesystem::path& log, RangeFinder range_finder = RangeFinder::kCan);
  ~World();
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  /// Flies for so long, once. `actions` in order of time.
  void fly(double length_s, std::vector<Action> actions);
  /// As fly(), piece by piece and without actions: on to a time since the flight began, and at last to its end.
  void fly_until(double t_s);
  void finish();

  SimulatedImu& imu() { return imu_; }
  CameraFaults& camera() { return camera_.faults; }
  RangeFaults& range() { return range_.faults; }
  test::LidarLiteEmulator& lidar_lite() { return lidar_lite_.unit(); }
  HostFaults& host() { return host_; }
  std::int64_t now_ns() const { return t_ns_; }
  /// The flight clock goes ahead of the world by that much.
  void step_clock(std::int64_t step_ns);
  /// What the tick task and the nav job hold in force, for memory that fails.
  ParameterStore& tick_parameters() { return const_cast<ParameterStore&>(tick_.parameters()); }
  ParameterStore& nav_parameters() { return const_cast<ParameterStore&>(nav_->job().parameters()); }
  /// Bytes on channel COMMAND.
  void send_command(std::span<const std::uint8_t> message);

  const SeenFlight& seen() const { return observer_.seen(); }
  /// What is seen from now on. Long flights need it, to stay within their memory.
  void forget_seen() { observer_.forget(); }
  const JobAccount& account(FlightJob job) const { return tick_.account(job); }
  const GateCounters& gate() const { return tick_.gate().counters(); }
  std::uint64_t log_records_lost() const { return writer_.dropped() + writer_.refused(); }
  /// No slot was left for an image, or a ring was full.
  std::uint64_t inputs_lost() const;

 private:
  /// A task's clock. Waiting on that of the tick lets the world go on.
  class WorldClock final : public Clock {
   public:
    WorldClock(World& world, bool drives) : world_(world), drives_(drives) {}
    Time now() const override { return world_.flight_time(); }
    void wait_until(Time t) override;
    void wake() override { woken_ = true; }

   private:
    World& world_;
    bool drives_;
    bool woken_ = false;
  };
  class SlowTracker final : public Tracker<FlightConfig::kMaxTracks> {
   public:
    SlowTracker(World& world, FlightTracker<FlightConfig>& tracker) : world_(world), tracker_(tracker) {}
    Status track(const CameraFrame& frame, const MotionPrediction& motion,
                 FeatureFrame<FlightConfig::kMaxTracks>& out) override;
    void use(const TrackerOptions& options) override { tracker_.use(options); }
    void reset() override { tracker_.reset(); }

   private:
    World& world_;
    FlightTracker<FlightConfig>& tracker_;
  };
  Time flight_time() const { return Time::from_ns(t_ns_ + clock_offset_ns_); }
  void step();
  void run_devices();
  void run_nav(bool at_once);

  static constexpr std::int64_t kStart_ns = 100'000'000'000;
  static constexpr std::int64_t kStep_ns = 500'000;

  std::int64_t t_ns_ = kStart_ns;
  std::int64_t clock_offset_ns_ = 0;
  HostFaults host_;
  std::vector<Action> actions_;
  std::size_t next_action_ = 0;
  test::PlaneFlight flight_;
  SimulatedImu imu_;
  SimulatedCamera camera_;
  SimulatedRange range_;
  SimulatedLidarLite lidar_lite_;
  Observer observer_;

  FlightSetup setup_;
  WorldClock clock_;
  WorldClock tick_clock_;
  test::StandingClock nav_clock_;  ///< but for the time that the tracker takes
  std::unique_ptr<LcmLogWriter> file_;
  ThreadLog imu_log_;
  ThreadLog range_log_;
  ThreadLog camera_log_;
  ThreadLog tick_log_;
  ThreadLog nav_log_;
  LogWriter writer_;
  std::unique_ptr<SensorRings> rings_;
  std::unique_ptr<NavLink> link_;
  ImuTask imu_task_;
  CameraTask camera_task_;
  std::optional<CanRangeTask> can_range_task_;    ///< either this
  std::optional<LidarLiteTask> lidar_lite_task_;  ///< or this
  TickTask tick_;
  std::unique_ptr<FlightTracker<FlightConfig>> tracker_;
  SlowTracker slow_tracker_;
  std::unique_ptr<NavTask<FlightConfig>> nav_;

  std::int64_t t_imu_read_ns_ = kStart_ns;
  std::int64_t t_drained_ns_ = kStart_ns;
  bool nav_works_ = false;
  Time t_nav_start_;  ///< on the flight clock
  std::int64_t t_nav_end_ns_ = 0;
};

}  // namespace plumb::faults
