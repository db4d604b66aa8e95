#pragma once
// The flight software as a process: devices, threads and log, put together, started, watched and stopped. What flies is
// in fsw and drivers; what is here may use the heap and wait, before the flight and after it.

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "config/flight_config.h"
#include "hal/linux/lcm_log.h"
#include "hal/linux/realtime_thread.h"
#include "process/supervisor.h"

namespace plumb {

/// What is known when all threads have ended.
struct FlightSummary {
  std::uint64_t ticks = 0;
  std::uint64_t images = 0;
  std::uint64_t images_skipped = 0;
  std::uint64_t results_late = 0;
  std::uint64_t nav_missed = 0;
  std::uint64_t logged = 0;
  std::uint64_t not_logged = 0;
  std::vector<std::string> lines;  ///< for people: schedule, stacks, devices
};

class FlightProcess {
 public:
  /// `setup` without faults.
  explicit FlightProcess(const FlightSetup& setup);
  ~FlightProcess();

  /// Opens log, telemetry and devices. Everything that is wrong is added to `faults`.
  void open(std::vector<std::string>& faults);
  /// Starts every thread. What the system does not permit is added to `warnings`. False: it cannot fly.
  bool start(std::vector<std::string>& warnings);
  /// Waits at most `timeout`, or until `stopped`, for every device to say something, and tells in `lines` what each has
  /// said. False: one without which nothing flies, IMU or camera, is silent.
  bool self_test(Duration timeout, const std::function<bool()>& stopped, std::vector<std::string>& lines);
  /// Every thread's count of turns.
  const ProgressBoard& progress() const;
  /// Puts the threads under watch; after start(). Those of log and commands may wait for what is not of the flight: of
  /// them it is only told.
  void watch_with(Supervisor& supervisor) const;
  /// Ends every thread, the log's last, and closes the log.
  FlightSummary stop();

  const std::string& log_file() const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace plumb
