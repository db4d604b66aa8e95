#include "process/flight_process.h"

#include <atomic>
#include <cstdio>
#include <cstring>
#include <optional>

#include "fsw/app/nav_task.h"
#include "fsw/app/tick_task.h"
#include "fsw/telemetry/command_messages.h"
#include "fsw/vision/flight_tracker.h"
#include "hal/include/no_sink.h"
#include "hal/linux/can_socket.h"
#include "hal/linux/frame_socket.h"
#include "hal/linux/i2c_bus.h"
#include "hal/linux/lcm_sink.h"
#include "hal/linux/lcm_source.h"
#include "hal/linux/linux_clock.h"
#include "hal/linux/log_writer.h"
#include "hal/linux/resident_memory.h"
#include "hal/linux/serial_port.h"
#include "hal/linux/v4l2_camera.h"
#include "process/device_tasks.h"
#include "process/fault_line.h"
#include "process/log_file.h"
#include "process/thread_log.h"

namespace plumb {
namespace {

constexpr std::size_t index(FlightThread thread) { return static_cast<std::size_t>(thread); }

// The large objects, in static memory: one process flies once.
SensorRings& sensor_rings() {
  static SensorRings rings;
  return rings;
}
NavLink& nav_link() {
  static NavLink link;
  return link;
}

}  // namespace

struct FlightProcess::Parts {
  explicit Parts(const FlightSetup& flight) : setup(flight) {}

  /// The body of a thread: one turn after the other until the flight is over.
  template <class Task>
  struct Loop {
    Task* task = nullptr;
    FlightThread key{};
    ProgressBoard* progress = nullptr;
    const std::atomic<bool>* stop = nullptr;
    static void run(void* context) {
      const Loop& loop = *static_cast<Loop*>(context);
      while (!loop.stop->load(std::memory_order_acquire)) {
        loop.task->run_once();
        loop.progress->moved(loop.key);
      }
      loop.task->run_once();  // what others left for it before they ended
    }
  };
  template <class Task>
  bool start(FlightThread thread, Loop<Task>& loop, Task& task, std::vector<std::string>& warnings) {
    loop = {.task = &task, .key = thread, .progress = &progress, .stop = &stops[index(thread)]};
    const ThreadSetup& wanted = setup.threads[index(thread)];
    const ThreadOptions options{.name = kFlightThreadNames[index(thread)],
                                .priority = wanted.priority,
                                .core = wanted.core,
                                .stack_bytes = thread == FlightThread::kNav ? kNavStackBytes : kStackBytes};
    return threads[index(thread)].start(options, &Loop<Task>::run, &loop, warnings);
  }

  /// The log's thread: it may wait for the disk, nobody waits for it.
  struct LogTask {
    LogWriter& writer;
    Clock& clock;
    DeviceFaultReport<kLogFaults.size()> report{FaultyDevice::kLog, sensor_rings().log_faults};
    void run_once() {
      constexpr Duration kPeriod = Duration::from_ms(10);
      const Time now = clock.now();
      writer.drain(now);
      report.look(now, faults());
      clock.wait_until(clock.now() + kPeriod);
    }
    std::array<FaultCounter, kLogFaults.size()> faults() const { return {writer.dropped(), writer.refused()}; }
  };

  static constexpr std::size_t kStackBytes = std::size_t{128} << 10;
  static constexpr std::size_t kNavStackBytes = std::size_t{256} << 10;  // Eigen's temporaries

  const FlightSetup setup;
  std::array<std::atomic<bool>, kFlightThreadNames.size()> stops{};
  ProgressBoard progress;
  NoSink no_sink;
  std::string log_name;
  std::unique_ptr<LcmLogWriter> log_file;
  std::unique_ptr<LcmSink> tick_lcm;  // one per thread: they share no lock
  std::unique_ptr<LcmSink> nav_lcm;
  std::unique_ptr<LcmSource> command_lcm;

  std::array<LinuxClock, kFlightThreadNames.size()> clocks;
  ThreadLog imu_log{"imu", LogSizes::kDevice};
  ThreadLog range_log{"range", LogSizes::kDevice};
  ThreadLog camera_log{"camera", LogSizes::kImages};
  ThreadLog tick_log{"tick", LogSizes::kTick};
  ThreadLog nav_log{"nav", LogSizes::kNav};
  std::optional<LogWriter> writer;
  std::optional<LogTask> log_task;

  std::unique_ptr<LinuxSerialPort> imu_port;
  std::unique_ptr<CameraPort> camera_port;
  std::unique_ptr<I2cBus> range_bus;
  std::unique_ptr<CanSocket> range_socket;
  std::optional<ImuTask> imu;
  std::optional<CameraTask> camera;
  std::optional<LidarLiteTask> lidar_lite;
  std::optional<CanRangeTask> can_range;
  std::optional<CommandTask> command;
  std::optional<TickTask> tick;
  NavTask<FlightConfig>* nav = nullptr;

  Loop<ImuTask> imu_loop;
  Loop<CameraTask> camera_loop;
  Loop<LidarLiteTask> lidar_lite_loop;
  Loop<CanRangeTask> can_range_loop;
  Loop<CommandTask> command_loop;
  Loop<TickTask> tick_loop;
  Loop<NavTask<FlightConfig>> nav_loop;
  Loop<LogTask> log_loop;
  std::array<RealtimeThread, kFlightThreadNames.size()> threads;

  LinuxClock& clock(FlightThread thread) { return clocks[index(thread)]; }
  void open_log(std::vector<std::string>& faults);
  void open_telemetry(std::vector<std::string>& faults);
  void open_commands(std::vector<std::string>& faults);
  void open_devices(std::vector<std::string>& faults);
  void put_together();
  std::uint64_t ranges() const { return lidar_lite ? lidar_lite->samples() : can_range ? can_range->samples() : 0; }
  void describe(FlightSummary& summary) const;
  void describe_devices(FlightSummary& summary) const;
};

void FlightProcess::Parts::open_log(std::vector<std::string>& faults) {
  if (setup.log.empty()) return;
  log_name = free_name(setup.log);
  std::string error;
  log_file = LcmLogWriter::open(log_name, error);
  if (log_file == nullptr) {
    faults.push_back("log: " + error);
  } else if (!ok(write_session(*log_file, setup, clock_now())) || !ok(log_file->flush())) {
    faults.push_back("log: " + log_name + " cannot be written");
  }
}

void FlightProcess::Parts::open_telemetry(std::vector<std::string>& faults) {
  if (setup.lcm_url.empty()) return;
  std::string error;
  tick_lcm = LcmSink::open(setup.lcm_url, error);
  if (tick_lcm != nullptr) nav_lcm = LcmSink::open(setup.lcm_url, error);
  if (nav_lcm == nullptr) faults.push_back("lcm: " + error);
}

// Where messages of other hosts would come in too, commands of this one are done without.
void FlightProcess::Parts::open_commands(std::vector<std::string>& faults) {
  if (setup.lcm_url.empty() || setup.commands == CommandAccess::kOff) return;
  if (setup.commands == CommandAccess::kLocal && !stays_on_host(setup.lcm_url)) return;
  std::string error;
  command_lcm = LcmSource::open(setup.lcm_url, channel::kCommand, error);
  if (command_lcm == nullptr) faults.push_back("commands: " + error);
}

void FlightProcess::Parts::open_devices(std::vector<std::string>& faults) {
  const auto take = [&faults](const char* name, auto&& port, const std::string& error) {
    if (port == nullptr) faults.push_back(std::string(name) + ": " + error);
    return std::move(port);
  };
  std::string error;
  imu_port = take("imu", LinuxSerialPort::open(setup.imu.device, {.baud = setup.imu.settings.baud}, error), error);
  if (setup.camera.socket.empty()) {
    V4l2CameraOptions options;
    options.device = setup.camera.device;
    options.sensor = setup.camera.subdevice;
    options.trigger_control = setup.camera.trigger_control;
    camera_port = take("camera", V4l2Camera::open(options, error), error);
  } else {
    camera_port = take("camera", FrameSocket::open(setup.camera.socket, error), error);
  }
  if (setup.range.kind == RangeDevice::kLidarLite) {
    range_bus = take("range", LinuxI2cBus::open(setup.range.device, error), error);
  } else if (setup.range.kind == RangeDevice::kCan) {
    range_socket = take("range", LinuxCanSocket::open(setup.range.device, error), error);
  }
}

void FlightProcess::Parts::put_together() {
  static_assert(LogWriter::kMaxRecordBytes >=
                kImageHeaderBytes + FlightConfig::kMaxImageWidth * FlightConfig::kMaxImageHeight);
  LogSink& file = log_file == nullptr ? static_cast<LogSink&>(no_sink) : *log_file;
  writer.emplace(file, std::vector{&imu_log.log, &range_log.log, &camera_log.log, &nav_log.log}, tick_log.log);
  log_task.emplace(*writer, clock(FlightThread::kLog));
  SensorRings& rings = sensor_rings();
  NavLink& link = nav_link();
  Clock& tick_clock = clock(FlightThread::kTick);
  imu.emplace(*imu_port, setup.imu.settings, rings, clock(FlightThread::kImu), tick_clock, imu_log.log);
  camera.emplace(*camera_port, setup.camera, setup.calibration.camera, rings, clock(FlightThread::kCamera),
                 camera_log.log);
  if (range_bus != nullptr) {
    lidar_lite.emplace(*range_bus, setup.range.lidar_lite, rings, clock(FlightThread::kRange), range_log.log);
  }
  if (range_socket != nullptr) {
    can_range.emplace(*range_socket, setup.range, rings, clock(FlightThread::kRange), range_log.log);
  }
  if (command_lcm != nullptr) command.emplace(*command_lcm, rings, clock(FlightThread::kCommand));
  const auto sink = [this](const std::unique_ptr<LcmSink>& lcm) -> TelemetrySink& {
    return lcm == nullptr ? static_cast<TelemetrySink&>(no_sink) : *lcm;
  };
  Clock& nav_clock = clock(FlightThread::kNav);
  tick.emplace(setup.parameters, rings, link, tick_clock, nav_clock, tick_log.log, sink(tick_lcm));
  static std::optional<FlightTracker<FlightConfig>> tracker;
  tracker.emplace(setup.calibration.camera, setup.parameters.tracker);
  static std::optional<NavTask<FlightConfig>> nav_task;
  nav = &nav_task.emplace(setup.calibration, setup.parameters, *tracker, rings, link, nav_clock, nav_log.log,
                          sink(nav_lcm));
}

FlightProcess::FlightProcess(const FlightSetup& setup) : parts_(std::make_unique<Parts>(setup)) {}
FlightProcess::~FlightProcess() = default;

const std::string& FlightProcess::log_file() const { return parts_->log_name; }

void FlightProcess::open(std::vector<std::string>& faults) {
  limit_thread_memory(Parts::kStackBytes);
  parts_->open_devices(faults);
  parts_->open_telemetry(faults);
  parts_->open_commands(faults);
  if (faults.empty()) parts_->open_log(faults);  // a start that fails leaves no empty logs
  if (faults.empty()) parts_->put_together();
}

// Those that are woken before those that wake them; the devices last.
bool FlightProcess::start(std::vector<std::string>& warnings) {
  Parts& p = *parts_;
  if (const std::string warning = lock_memory(); !warning.empty()) warnings.push_back(warning);
  if (!p.imu_port->low_latency()) {
    warnings.push_back("imu: the driver of " + p.setup.imu.device +
                       " offers no low latency: behind a USB adapter bytes may wait for up to 16 ms");
  }
  if (!p.command && !p.setup.lcm_url.empty() && p.setup.commands == CommandAccess::kLocal) {
    warnings.push_back("takes no commands: the route to " + p.setup.lcm_url +
                       " leads to a network (ip route add 224.0.0.0/4 dev lo keeps it here; commands: network takes " +
                       "those of other hosts too)");
  }
  bool started = p.start(FlightThread::kLog, p.log_loop, *p.log_task, warnings) &&
                 p.start(FlightThread::kNav, p.nav_loop, *p.nav, warnings) &&
                 p.start(FlightThread::kTick, p.tick_loop, *p.tick, warnings) &&
                 p.start(FlightThread::kCamera, p.camera_loop, *p.camera, warnings);
  if (p.command) started = started && p.start(FlightThread::kCommand, p.command_loop, *p.command, warnings);
  if (p.lidar_lite) started = started && p.start(FlightThread::kRange, p.lidar_lite_loop, *p.lidar_lite, warnings);
  if (p.can_range) started = started && p.start(FlightThread::kRange, p.can_range_loop, *p.can_range, warnings);
  return started && p.start(FlightThread::kImu, p.imu_loop, *p.imu, warnings);
}

bool FlightProcess::self_test(Duration timeout, const std::function<bool()>& stopped, std::vector<std::string>& lines) {
  const Parts& p = *parts_;
  LinuxClock clock;
  const bool has_range = p.setup.range.kind != RangeDevice::kNone;
  const Time end = clock.now() + timeout;
  const auto silent = [&] {
    return p.imu->samples() == 0 || p.camera->images() == 0 || (has_range && p.ranges() == 0);
  };
  constexpr Duration kLook = Duration::from_ms(20);
  while (silent() && clock.now() < end && !stopped()) clock.wait_until(clock.now() + kLook);
  const auto tell = [&lines](const char* name, std::uint64_t count, const std::string& reason) {
    lines.push_back(std::string(name) + (count > 0 ? ": speaks" : ": silent" + reason));
  };
  const bool refused = p.imu->state() == stim300::State::kRefused;
  tell("imu", p.imu->samples(), refused ? ": it is set up otherwise than the configuration says" : "");
  tell("camera", p.camera->images(), "");
  if (has_range) tell("range", p.ranges(), "; flying without ranges until it speaks");
  return p.imu->samples() > 0 && p.camera->images() > 0;
}

void FlightProcess::watch_with(Supervisor& supervisor) const {
  const Parts& p = *parts_;
  for (const FlightThread thread : {FlightThread::kImu, FlightThread::kCamera, FlightThread::kTick, FlightThread::kNav})
    supervisor.watch(thread);
  if (p.lidar_lite || p.can_range) supervisor.watch(FlightThread::kRange);
  supervisor.look_after(FlightThread::kLog);
  if (p.command) supervisor.look_after(FlightThread::kCommand);
}

const ProgressBoard& FlightProcess::progress() const { return parts_->progress; }

FlightSummary FlightProcess::stop() {
  Parts& p = *parts_;
  // One after the other in the direction of the data, so that what is in the log is whole: every frame has its state.
  for (const FlightThread thread :
       {FlightThread::kCommand, FlightThread::kImu, FlightThread::kCamera, FlightThread::kRange, FlightThread::kTick,
        FlightThread::kNav, FlightThread::kLog}) {
    p.stops[index(thread)].store(true, std::memory_order_release);
    p.clock(thread).wake();
    p.threads[index(thread)].join();
  }
  p.writer->drain(clock_now());
  FlightSummary summary;
  p.describe(summary);
  if (p.log_file != nullptr && !ok(p.log_file->flush())) ++summary.not_logged;
  p.log_file.reset();
  return summary;
}

void FlightProcess::Parts::describe(FlightSummary& summary) const {
  const GateCounters& gate = tick->gate().counters();
  summary.ticks = tick->account(kJobAssemble).runs();
  summary.images = nav->job().counters().frames - nav->job().counters().frames_skipped;
  summary.images_skipped = gate.images_skipped;
  summary.results_late = gate.results_late;
  summary.nav_missed = gate.nav_missed;
  summary.logged = writer->written();
  summary.not_logged = writer->dropped() + writer->refused();
  char line[160];
  for (std::size_t job = 0; job < kFlightSchedule.size(); ++job) {
    const JobAccount& account = tick->account(static_cast<FlightJob>(job));
    std::snprintf(line, sizeof line, "job %-9s runs %8llu, mean %6.0f us, longest %7.0f us, overruns %llu, slips %llu",
                  kFlightSchedule[job].name.data(), static_cast<unsigned long long>(account.runs()),
                  1e6 * account.mean().seconds(), 1e6 * account.max().seconds(),
                  static_cast<unsigned long long>(account.overruns()),
                  static_cast<unsigned long long>(account.slips()));
    summary.lines.emplace_back(line);
  }
  describe_devices(summary);
  const LatencyHistogram& latency = tick->imu_latency();
  std::snprintf(line, sizeof line, "IMU sample to output: %llu, median %.0f us, 99.9 %% %.0f us, longest %.0f us",
                static_cast<unsigned long long>(latency.count()), 1e6 * latency.permille(500).seconds(),
                1e6 * latency.permille(999).seconds(), 1e6 * latency.max().seconds());
  summary.lines.emplace_back(line);
  std::snprintf(line, sizeof line, "memory at most %.1f MiB", peak_resident_mib());
  summary.lines.emplace_back(line);
  if (command) {
    std::snprintf(line, sizeof line, "channel COMMAND: %llu messages were no command, %llu came too fast",
                  static_cast<unsigned long long>(command->not_commands()),
                  static_cast<unsigned long long>(sensor_rings().commands.overflows()));
    summary.lines.emplace_back(line);
    if (const FaultCounter& failures = command->failures(); failures > 0) {
      summary.lines.push_back("channel COMMAND: LCM failed " + std::to_string(failures.count) +
                              " times, the last: " + std::strerror(static_cast<int>(failures.value)));
    }
  }
  for (const RealtimeThread& thread : threads) {
    if (thread.options().name[0] == '\0') continue;
    std::snprintf(line, sizeof line, "thread %-7s stack used %zu of %zu bytes, page faults %ld", thread.options().name,
                  thread.stack_used(), thread.options().stack_bytes, thread.page_faults());
    summary.lines.emplace_back(line);
  }
}

void FlightProcess::Parts::describe_devices(FlightSummary& summary) const {
  summary.lines.push_back(fault_line(FaultyDevice::kStim300, imu->faults()));
  summary.lines.push_back(fault_line(FaultyDevice::kCamera, camera->faults()));
  if (lidar_lite) summary.lines.push_back(fault_line(FaultyDevice::kLidarLite, lidar_lite->faults()));
  if (can_range) summary.lines.push_back(fault_line(FaultyDevice::kCanRange, can_range->faults()));
  summary.lines.push_back(fault_line(FaultyDevice::kLog, log_task->faults()));
  if (log_file != nullptr && log_file->last_error() != 0) {
    summary.lines.push_back("the log ends before the flight: " + std::string(std::strerror(log_file->last_error())));
  }
  for (const LcmSink* lcm : {tick_lcm.get(), nav_lcm.get()}) {
    if (lcm == nullptr || lcm->lost() == 0) continue;
    summary.lines.push_back("telemetry: " + std::to_string(lcm->lost()) +
                            " messages lost, the last: " + std::strerror(lcm->last_error()));
  }
}

}  // namespace plumb
