// plumb-fsw flies with emulated devices on real interfaces, in real time; its log is flown again, from the input frames
// and from the bytes of the devices, and gives the same bits.
//
// PLUMB_LIVE_SECONDS: length of a flight, 12 by default. PLUMB_LIVE_LOAD: threads that burn time beside the flight
// under a kernel of its own, 0 by default.

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <map>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "fsw/events/device_faults.h"
#include "fsw/events/event.h"
#include "fsw/measurement/nav_state.h"
#include "fsw/telemetry/executive_messages.h"
#include "hal/linux/lcm_log.h"
#include "plumb_lcm/plumb/event_t.hpp"
#include "test/live/emulated_vehicle.h"
#include "test/live/flight_program.h"
#include "test/support/process.h"
#include "test/support/service_socket.h"
#include "test/support/temporary_folder.h"
#include "test/unit/hal/kernel_part.h"

namespace plumb::test {
namespace {

namespace fs = std::filesystem;

double flight_length_s() {
  const char* wanted = std::getenv("PLUMB_LIVE_SECONDS");
  return wanted == nullptr ? 12.0 : std::atof(wanted);
}

unsigned load_in_kernel() {
  const char* wanted = std::getenv("PLUMB_LIVE_LOAD");
  return wanted == nullptr ? 0 : static_cast<unsigned>(std::atoi(wanted));
}

/// Every IMU sample counts from its arrival, which is within the flight.
void expect_latencies(const std::string& output) {
  const std::string name = "IMU sample to output: ";
  ASSERT_NE(output.find(name), std::string::npos) << output;
  const std::string line = output.substr(output.find(name));
  EXPECT_GT(number_after(line, name), 0) << output;
  EXPECT_GT(number_after(line, "longest "), 0) << output;
  EXPECT_LT(number_after(line, "longest "), 1e6 * flight_length_s()) << output;
}

/// Of all threads only the one that starts and ends the flight, and the one that receives over LCM, took from the heap.
void expect_no_heap(const std::string& output) {
  const std::string words = "heap calls of thread ";
  std::vector<std::string> callers;
  for (std::size_t at = output.find(words); at != std::string::npos; at = output.find(words, at + 1)) {
    const std::size_t name = at + words.size();
    callers.push_back(output.substr(name, output.find(':', name) - name));
  }
  ASSERT_FALSE(callers.empty()) << "starting a flight takes memory; nobody counted: " << output;
  EXPECT_EQ(callers.front(), "plumb-fsw");
  callers.erase(callers.begin());
  std::erase(callers, "command");
  EXPECT_EQ(callers, std::vector<std::string>{}) << output;
}

/// Both ways of flying the log again give the hashes of the flight, `states_hz` states a second and more, and logs
/// without a difference. Returns what the first replay said.
std::string expect_equal_replays(const fs::path& folder, double states_hz = 5.0) {
  std::string said;
  const std::string log = (folder / "flight.lcm").string();
  for (const std::string how : {"", " --raw"}) {
    const std::string again = (folder / ("again" + std::string(how.empty() ? "" : "_raw") + ".lcm")).string();
    const ProgramOutput replay =
        output_of(std::string(PLUMB_REPLAY) + " --log " + log + how + " --record " + again + " 2>&1");
    EXPECT_EQ(replay.exit_status, 0) << replay.text;
    EXPECT_NE(replay.text.find(", all equal"), std::string::npos) << replay.text;
    EXPECT_GT(number_after(replay.text, "with a state "), states_hz * flight_length_s()) << replay.text;
    const ProgramOutput difference =
        output_of("PYTHONPATH=" PLUMB_SOURCE_DIR "/tools " PLUMB_PYTHON " -m plumb_tools.hashdiff " + log + " " +
                  again + " 2>&1");
    EXPECT_EQ(difference.exit_status, 0) << difference.text;
    EXPECT_GT(number_after(difference.text, "EVENTS: "), 2) << difference.text;
    if (said.empty()) said = replay.text;
  }
  return said;
}

struct LiveFlight {
  std::string output;
  int exit_code = -1;
};

/// Threads that only burn time.
class Load {
 public:
  explicit Load(unsigned threads) {
    for (unsigned i = 0; i < threads; ++i) {
      threads_.emplace_back([](const std::stop_token& stop) {
        while (!stop.stop_requested()) {
        }
      });
    }
  }

 private:
  std::vector<std::jthread> threads_;
};

/// `niceness`: 0 is the system's usual share of its time, 19 the least. `halfway`: what is done in the middle of the
/// flight. `load`: threads that burn time beside it.
LiveFlight fly(
    const fs::path& folder, const std::string& can, const std::string& more, int niceness = 0,
    const std::function<void(EmulatedVehicle&)>& halfway = [](EmulatedVehicle&) {}, unsigned load = 0) {
  const double length_s = flight_length_s();
  EmulatedVehicle vehicle({.camera_socket = folder / "camera", .can = can}, length_s + 10.0);
  const Load burning(load);
  const fs::path config = folder / "flight.yaml";
  std::ofstream(config) << flight_configuration(vehicle.imu_device(), vehicle.image_rate_hz(), folder / "flight.lcm",
                                                "socket: " + (folder / "camera").string(), more);
  std::vector<std::string> words{"nice", "-n", std::to_string(niceness)};
#ifdef PLUMB_HEAP_TRAP
  words.insert(words.end(), {"env", "LD_PRELOAD=" PLUMB_HEAP_TRAP});
#endif
  words.insert(words.end(), {PLUMB_FSW, config.string()});
  FlightProgram program(words, folder / "output");
  const std::chrono::duration<double> half(0.5 * length_s);
  std::this_thread::sleep_for(half);
  halfway(vehicle);
  std::this_thread::sleep_for(half);
  const int exit_code = program.stop();
  const std::string output = program.output();
  std::printf("%s", output.c_str());  // how punctual it was: docs/executive.md has the figures of longer flights
#ifdef PLUMB_HEAP_TRAP
  expect_no_heap(output);
#endif
  return {.output = output, .exit_code = exit_code};
}

TEST(LiveFlight, ReplaysBitByBit) {
  const TemporaryFolder folder;
  ServiceSocket systemd(folder.path() / "notify");
  setenv("NOTIFY_SOCKET", systemd.name().c_str(), 1);
  std::vector<std::string> told;
  const auto listen = [&] {
    for (const std::string& word : systemd.take()) told.push_back(word);
  };
  // All along: the system keeps only a few words for a manager that does not listen.
  std::jthread manager([&](const std::stop_token& stop) {
    for (; !stop.stop_requested(); std::this_thread::sleep_for(std::chrono::milliseconds(100))) listen();
  });
  const LiveFlight flight = fly(folder.path(), "", "");
  manager = {};
  listen();
  unsetenv("NOTIFY_SOCKET");
  ASSERT_GT(told.size(), std::size_t{2});
  EXPECT_EQ(told.front(), "READY=1");
  EXPECT_EQ(told[1], "WATCHDOG=1");
  EXPECT_EQ(told.back(), "STOPPING=1");
  ASSERT_EQ(flight.exit_code, 0) << flight.output;
  expect_latencies(flight.output);
  const std::string no_low_latency = "offers no low latency";  // a pseudo-terminal does not
  EXPECT_NE(flight.output.find(no_low_latency), std::string::npos) << flight.output;
  EXPECT_EQ(flight.output.find(no_low_latency), flight.output.rfind(no_low_latency)) << "told once";
  EXPECT_GT(number_after(flight.output, "ticks "), 200 * (flight_length_s() - 3)) << flight.output;
  EXPECT_GT(number_after(flight.output, "images "), 15 * (flight_length_s() - 3)) << flight.output;
  expect_equal_replays(folder.path());
}

const std::string kNoPriority =
    "threads:\n  imu: {priority: 0}\n  tick: {priority: 0}\n  camera: {priority: 0}\n  range: {priority: 0}\n"
    "  nav: {priority: 0}\n";

/// A flight that has no priority at all, beside `load` threads that only burn time.
LiveFlight fly_too_slowly(const fs::path& folder, const std::string& can, const std::string& more, unsigned load) {
  LiveFlight flight = fly(folder, can, kNoPriority + more, 5, [](EmulatedVehicle&) {}, load);
  EXPECT_GT(number_after(flight.output, "results late "), 0) << "not slow enough to show anything: " << flight.output;
  return flight;
}

TEST(LiveFlight, ReplaysBitByBitWhenTheMachineIsTooSlow) {
  const TemporaryFolder folder;
  const LiveFlight flight = fly_too_slowly(folder.path(), "", "", 4 * std::thread::hardware_concurrency());
  ASSERT_EQ(flight.exit_code, 0) << flight.output;
  expect_equal_replays(folder.path());
}

/// What the log has on channel EVENTS.
std::vector<event_t> events_of(const fs::path& log) {
  std::string error;
  const std::unique_ptr<LcmLogReader> reader = LcmLogReader::open(log.string(), error);
  std::vector<event_t> events;
  for (LogEvent event; reader != nullptr && ok(reader->next(event));) {
    if (event.channel != channel::kEvents) continue;
    if (events.emplace_back().decode(event.message.data(), 0, static_cast<int>(event.message.size())) < 0) return {};
  }
  return events;
}

/// Whether the log tells that a counter of the STIM300 has come to `count`.
bool tells(const fs::path& log, std::string_view counter, long count) {
  const std::vector<event_t> events = events_of(log);
  return std::any_of(events.begin(), events.end(), [&](const event_t& said) {
    return said.id == static_cast<int>(EventId::kDeviceFault) && said.arguments[0] == 0 &&
           kStim300Faults.at(static_cast<std::size_t>(said.arguments[1])).name == counter && said.arguments[2] == count;
  });
}

// Before the commands bytes of the IMU have wrong bits for a second: they are counted and told, and the flight goes on.
TEST(NetworkLiveFlight, ObeysACommandTellsOfWrongBytesAndReplaysBoth) {
  const char* url = std::getenv("PLUMB_TEST_LCM_URL");
  if (url == nullptr) GTEST_SKIP() << "runs in a network namespace of its own, see the test live_in_network";
  const TemporaryFolder folder;
  const auto command = [url](const std::string& what) {
    return output_of("PYTHONPATH=" PLUMB_SOURCE_DIR "/tools " PLUMB_PYTHON " -m plumb_tools.command " + what +
                     " --lcm '" + url + "' 2>&1");
  };
  ProgramOutput ping;
  ProgramOutput reset;
  ProgramOutput set;
  ProgramOutput refused;
  ProgramOutput get;
  const LiveFlight flight = fly(folder.path(), "", "lcm: " + std::string(url) + "\n", 0, [&](EmulatedVehicle& vehicle) {
    vehicle.disturb_imu({.flipped_bit = 0.003});
    std::this_thread::sleep_for(std::chrono::seconds(1));
    vehicle.disturb_imu({});
    ping = command("ping");
    reset = command("reset");
    set = command("set range.gate_sigma 3 --program " PLUMB_REPLAY);
    refused = command("set range.min_range 99 --program " PLUMB_REPLAY);
    get = command("get range.gate_sigma");
  });
  ASSERT_EQ(flight.exit_code, 0) << flight.output;
  EXPECT_EQ(ping.exit_status, 0) << ping.text;
  EXPECT_EQ(reset.exit_status, 0) << reset.text;
  EXPECT_EQ(set.exit_status, 0) << set.text;
  EXPECT_EQ(refused.exit_status >> 8, 1) << refused.text;
  EXPECT_NE(refused.text.find("conflict"), std::string::npos) << refused.text;
  EXPECT_EQ(get.text, "range.gate_sigma 3\n");
  const std::size_t line = flight.output.find("faults of the STIM300: ");
  ASSERT_NE(line, std::string::npos) << flight.output;
  const long count = number_after(flight.output.substr(line), "checksum_errors ");
  EXPECT_GT(count, 0) << flight.output;
  EXPECT_TRUE(tells(folder.path() / "flight.lcm", "checksum_errors", count)) << flight.output;
  expect_equal_replays(folder.path());
  const ProgramOutput replay =
      output_of(std::string(PLUMB_REPLAY) + " --log " + (folder.path() / "flight.lcm").string() + " 2>&1");
  EXPECT_NE(replay.text.find("resets          1,"), std::string::npos) << replay.text;
  EXPECT_EQ(command("ping").exit_status >> 8, 3) << "nobody flies any more";
}

/// One NodeStatus, as the public Python package understood it.
struct NodeStatus {
  int node_id = 0;
  int health = 0;
  int mode = 0;
  int uptime_s = 0;
};

/// Listens on vcan0 until the flight is over.
class StatusListener {
 public:
  StatusListener()
      : program_(popen(PLUMB_PYTHON " " PLUMB_SOURCE_DIR "/test/emulators/can_range/can_range_node.py hear vcan0 2>&1",
                       "r")) {
    if (program_ == nullptr || next_line() != "listening\n") throw std::runtime_error("nobody listens: " + text_);
  }
  std::vector<NodeStatus> end() {
    std::vector<NodeStatus> heard;
    for (std::string line = next_line(); !line.empty(); line = next_line()) {
      NodeStatus status;
      const int found = std::sscanf(line.c_str(), "status %d %d %d %d", &status.node_id, &status.health, &status.mode,
                                    &status.uptime_s);
      if (found == 4) heard.push_back(status);
    }
    pclose(program_);
    return heard;
  }
  const std::string& text() const { return text_; }

 private:
  std::string next_line() {
    char line[256];
    if (std::fgets(line, sizeof line, program_) == nullptr) return {};
    text_ += line;
    return line;
  }
  std::FILE* program_;
  std::string text_;
};

/// Health and mode heard are those of the modes of the flight, in their order; some are too short to be heard.
void expect_statuses_of(const fs::path& log, const std::vector<NodeStatus>& heard) {
  using Condition = std::pair<int, int>;  // health and mode of a node
  const std::map<NavMode, Condition> conditions{{NavMode::kInitialising, {0, 1}},
                                                {NavMode::kRangeVio, {0, 0}},
                                                {NavMode::kVio, {1, 0}},
                                                {NavMode::kInertial, {2, 0}},
                                                {NavMode::kFailed, {3, 0}}};
  std::vector<Condition> expected{conditions.at(NavMode::kInitialising)};
  for (const event_t& event : events_of(log)) {
    if (event.id != static_cast<int>(EventId::kModeChanged)) continue;
    expected.push_back(conditions.at(static_cast<NavMode>(event.arguments[1])));
  }
  auto at = expected.begin();
  for (const NodeStatus& status : heard) {
    at = std::find(at, expected.end(), Condition{status.health, status.mode});
    ASSERT_NE(at, expected.end()) << "health " << status.health << ", mode " << status.mode << " at " << status.uptime_s
                                  << " s";
  }
  EXPECT_TRUE(std::any_of(heard.begin(), heard.end(), [](const NodeStatus& status) { return status.mode == 0; }))
      << "it never came to a state";
}

TEST(KernelLiveFlight, WithRangesOnCanReplaysBitByBitAndIsANodeOnTheBus) {
  PLUMB_NEEDS_KERNEL("CAN");
  const TemporaryFolder folder;
  StatusListener listener;
  const std::string range = range_section("can: vcan0\n  own_node_id: 77\n  latency_ms: 2");
  // This kernel has one slow processor. On that, threads of a priority leave no time to the one that writes the log.
  const unsigned load = load_in_kernel();
  const LiveFlight flight =
      load > 0 ? fly_too_slowly(folder.path(), "vcan0", range, load) : fly(folder.path(), "vcan0", kNoPriority + range);
  const std::vector<NodeStatus> heard = listener.end();
  ASSERT_EQ(flight.exit_code, 0) << flight.output;
  ASSERT_GE(heard.size(), 3U) << listener.text();
  EXPECT_LE(heard.size(), static_cast<std::size_t>(heard.back().uptime_s) + 1) << "once a second: " << listener.text();
  expect_statuses_of(folder.path() / "flight.lcm", heard);
  for (std::size_t i = 0; i < heard.size(); ++i) {
    EXPECT_EQ(heard[i].node_id, 77);
    EXPECT_GE(heard[i].uptime_s, i == 0 ? 0 : heard[i - 1].uptime_s);
  }
  EXPECT_NE(flight.output.find("range: speaks"), std::string::npos) << flight.output;
  constexpr double kStates_hz = 0.5;  // beside much else that runs there is time for few
  const std::string replay = expect_equal_replays(folder.path(), kStates_hz);
  EXPECT_GT(number_after(replay, "on a facet ") + number_after(replay, "by a feature "), 0) << replay;
  std::printf("%s", replay.c_str());  // how many ranges were used: docs/executive.md
}

}  // namespace
}  // namespace plumb::test
