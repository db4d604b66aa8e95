// plumb-fsw: the flight software on a board. Exit code 0 stopped in order, 1 it could not fly or the log is not whole,
// 2 a fault of the configuration, 3 a device without which nothing flies says nothing, 4 a device or the place of the
// log cannot be opened.

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <cinttypes>
#include <csignal>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include "config/arguments.h"
#include "config/flight_config.h"
#include "fsw/base/assert.h"
#include "fsw/vision/vector_unit.h"
#include "hal/linux/monotonic_clock.h"
#include "process/flight_process.h"
#include "process/host_check.h"
#include "process/mode_page.h"
#include "process/schedule_page.h"
#include "process/telemetry_page.h"

namespace plumb {
namespace {

constexpr int kExitFailed = 1;
constexpr int kExitBadInput = 2;
constexpr int kExitSilent = 3;
constexpr int kExitNotThere = 4;

constexpr double kLongestFlight_s = 1e8;                   // three years
constexpr Duration kSelfTest = Duration::from_ms(10'000);  // a STIM300 may take 5 s to start

struct Arguments {
  std::string config;
  std::string log;
  bool dry_run = false;
  bool schedule = false;
  bool modes = false;
  bool telemetry = false;
  double duration_s = 0.0;
};

void tell(const std::string& sentence) { std::fprintf(stderr, "plumb-fsw: %s\n", sentence.c_str()); }

int refuse(const std::vector<std::string>& faults, int exit_code) {
  for (const std::string& fault : faults) tell(fault);
  return exit_code;
}

// The thread that breaks an assertion is of no use any more; the log's other records are. What is in the queues goes
// down with the process, which a supervisor starts again.
void on_assertion(const AssertSite& site) {
  char text[256];
  const int size = std::snprintf(text, sizeof text, "plumb-fsw: bug: %s line %d: %s does not hold\n", site.file,
                                 site.line, site.condition);
  if (size > 0 && write(STDERR_FILENO, text, static_cast<std::size_t>(size)) < 0) return;
}

sigset_t stop_signals() {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&signals, signal);
  return signals;
}

bool stop_is_asked() {
  sigset_t pending;
  sigpending(&pending);
  return sigismember(&pending, SIGINT) == 1 || sigismember(&pending, SIGTERM) == 1 ||
         sigismember(&pending, SIGHUP) == 1;
}

// Until a signal, or until the time is over; 0: for ever. Meanwhile looks after the threads.
void wait_for_stop(double duration_s, Supervisor& supervisor) {
  const sigset_t signals = stop_signals();
  const Time end = duration_s > 0.0 ? clock_now() + Duration::from_seconds(duration_s) : Time::max();
  std::vector<std::string> stuck_before;
  for (Time now = clock_now(); now < end; now = clock_now()) {
    const std::int64_t wait_ns = std::min(supervisor.period(), end - now).ns();
    const timespec wait{.tv_sec = static_cast<time_t>(wait_ns / kNsPerSecond),
                        .tv_nsec = static_cast<long>(wait_ns % kNsPerSecond)};
    if (sigtimedwait(&signals, nullptr, &wait) > 0) return;
    if (clock_now() - now < supervisor.period()) continue;  // woken before its time
    const std::vector<std::string> stuck = supervisor.look();
    if (stuck != stuck_before) {
      for (const std::string& thread : stuck) tell("warning: thread " + thread + " does not get round");
    }
    stuck_before = stuck;
  }
}

void print(const FlightSummary& summary) {
  std::printf("ticks %" PRIu64 ", images %" PRIu64 ", skipped %" PRIu64 ", results late %" PRIu64
              ", frames that the nav job missed %" PRIu64 "\n",
              summary.ticks, summary.images, summary.images_skipped, summary.results_late, summary.nav_missed);
  std::printf("log records %" PRIu64 ", lost %" PRIu64 "\n", summary.logged, summary.not_logged);
  for (const std::string& line : summary.lines) std::printf("%s\n", line.c_str());
}

int fly(FlightProcess& process, double duration_s) {
  std::vector<std::string> warnings;
  const bool started = process.start(warnings);
  for (const std::string& warning : warnings) tell("warning: " + warning);
  std::vector<std::string> lines;
  const bool speaks = started && process.self_test(kSelfTest, stop_is_asked, lines);
  for (const std::string& line : lines) tell("self-test: " + line);
  if (speaks) {
    tell("flying" + (process.log_file().empty() ? std::string() : ", log " + process.log_file()));
    ServiceManager manager = ServiceManager::from_environment();
    Supervisor supervisor(process.progress(), manager);
    process.watch_with(supervisor);
    manager.tell("READY=1");
    wait_for_stop(duration_s, supervisor);
    manager.tell("STOPPING=1");
  }
  const FlightSummary summary = process.stop();
  print(summary);
  if (!started) return kExitFailed;
  if (!speaks && !stop_is_asked()) return kExitSilent;
  return summary.not_logged == 0 ? 0 : kExitFailed;
}

int run(const Arguments& arguments) {
  std::vector<std::string> faults;
  std::vector<std::string> warnings;
  FlightSetup setup = read_flight_config(arguments.config, faults);
  if (!arguments.log.empty()) setup.log = arguments.log;
  check_host(setup, arguments.config, faults, warnings);
  if (arguments.dry_run) check_log_folder(setup, faults);
  for (const std::string& warning : warnings) tell("warning: " + warning);
  if (!faults.empty()) return refuse(faults, kExitBadInput);
  if (arguments.dry_run) {
    std::printf("%s can be flown\n", arguments.config.c_str());
    return 0;
  }
  FlightProcess process(setup);
  process.open(faults);
  if (!faults.empty()) return refuse(faults, kExitNotThere);
  return fly(process, arguments.duration_s);
}

int main_of(int argc, char** argv) {
  set_assert_handler(on_assertion);
  // Before any thread: all of them leave the signals to the one that waits for them.
  const sigset_t signals = stop_signals();
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  Arguments arguments;
  CLI::App app("Flies with the devices of this board until it is told to stop (SIGINT, SIGTERM).", "plumb-fsw");
  CLI::Option* config =
      app.add_option("config", arguments.config, "YAML file with devices, calibration and parameters");
  app.add_option("--log", arguments.log, "LCM event log to write, in place of the configuration's");
  app.add_flag("--dry-run", arguments.dry_run, "check the configuration, name every fault of it, touch no device");
  app.add_flag("--schedule", arguments.schedule, "print the schedule as a table, and end");
  app.add_flag("--modes", arguments.modes, "print the modes and the states of sensors as tables, and end");
  app.add_flag("--telemetry", arguments.telemetry, "print what is sent when as a table, and end");
  app.add_option("--duration", arguments.duration_s, "stop by itself after that many seconds")
      ->check(number_from(1e-3, kLongestFlight_s));
  if (!vector_unit_present()) {
    tell(kVectorAdvice);
    return kExitFailed;
  }
  try {
    app.parse(argc, argv);
    if (arguments.schedule) {
      std::printf("%s", schedule_page().c_str());
      return 0;
    }
    if (arguments.modes) {
      std::printf("%s\n%s", mode_page().c_str(), sensor_page().c_str());
      return 0;
    }
    if (arguments.telemetry) {
      std::printf("%s", telemetry_page().c_str());
      return 0;
    }
    if (config->empty()) throw CLI::RequiredError("config");
    return run(arguments);
  } catch (const CLI::CallForHelp& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    tell(error.what());
    return kExitBadInput;
  } catch (const std::exception& error) {
    tell(std::string("internal failure: ") + error.what());
    return kExitFailed;
  }
}

}  // namespace
}  // namespace plumb

int main(int argc, char** argv) { return plumb::main_of(argc, argv); }
