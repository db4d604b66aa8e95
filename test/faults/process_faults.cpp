// Each row flies plumb-fsw and says what it has to look like.

#include "test/faults/process_faults.h"

#include <chrono>
#include <csignal>
#include <fstream>
#include <thread>

#include "hal/linux/lcm_log.h"
#include "test/live/emulated_vehicle.h"
#include "test/live/flight_program.h"
#include "test/support/process.h"
#include "test/support/temporary_folder.h"
#include "tools/hil/pseudo_terminal.h"

namespace plumb::faults {
namespace {

namespace fs = std::filesystem;
using test::EmulatedVehicle;
using test::FlightProgram;

constexpr double kLongest_s = 40.0;  // images are made for so long
// Without ranges the scale is told by acceleration alone.
constexpr double kPositionWithoutRange_m = 0.5;
constexpr double kVelocityWithoutRange_m_s = 0.2;
constexpr double kPositionWithRange_m = 0.2;
constexpr double kVelocityWithRange_m_s = 0.1;
constexpr const char* kRangeBus = "vcan0";

void sleep_for(double s) { std::this_thread::sleep_for(std::chrono::duration<double>(s)); }

fs::path write_configuration(const fs::path& folder, const std::string& imu_device, const std::string& more = "") {
  const fs::path file = folder / "flight.yaml";
  std::ofstream(file) << test::flight_configuration(imu_device, 20.0, folder / "flight.lcm",
                                                    "socket: " + (folder / "camera").string(), more);
  return file;
}

Finding compared(const std::string& expected, const std::string& seen) {
  return {.expected = expected, .seen = seen, .passed = expected == seen};
}

/// What the telemetry in a log says, its whole part.
SeenFlight flight_in(const fs::path& log, const EmulatedVehicle& vehicle) {
  Observer observer(vehicle.flight(), vehicle.t_start_s());
  std::string error;
  const std::unique_ptr<LcmLogReader> reader = LcmLogReader::open(log.string(), error);
  LogEvent event;
  while (reader != nullptr && ok(reader->next(event)))
    static_cast<void>(observer.publish(event.channel.c_str(), event.message));
  return observer.seen();
}

/// The range finder's bus, which is not there on every machine: test/emulators/in_user_mode_linux.sh makes one. Without
/// ranges there need be no state again in the air.
std::string range_bus() { return fs::exists(std::string("/sys/class/net/") + kRangeBus) ? kRangeBus : ""; }

EmulatedVehicle vehicle_in(const fs::path& folder) {
  return EmulatedVehicle({.camera_socket = folder / "camera", .can = range_bus()}, kLongest_s);
}

std::string ranges_of_vehicle() {
  return range_bus().empty() ? "" : test::range_section("can: " + range_bus() + "\n  latency_ms: 2");
}

/// Of what could be acted on.
Finding error_of(const SeenFlight& flight) {
  const bool ranged = !range_bus().empty();
  const double most_m = ranged ? kPositionWithRange_m : kPositionWithoutRange_m;
  const double most_m_s = ranged ? kVelocityWithRange_m_s : kVelocityWithoutRange_m_s;
  double worst_m = 0.0;
  double worst_m_s = 0.0;
  bool any = false;
  for (const SeenOutput& output : flight.outputs) {
    if (!output.valid || output.reliable_for_s <= 0.0) continue;
    any = true;
    worst_m = std::max(worst_m, output.position_error_m);
    worst_m_s = std::max(worst_m_s, output.velocity_error_m_s);
  }
  char seen[80];
  std::snprintf(seen, sizeof seen, "%.2f m, %.2f m/s", worst_m, worst_m_s);
  char expected[80];
  std::snprintf(expected, sizeof expected, "%.2f m, %.2f m/s", most_m, most_m_s);
  return {.expected = expected,
          .seen = any ? seen : "no state",
          .passed = worst_m <= most_m && worst_m_s <= most_m_s && (any || !ranged)};
}

Finding ending_of(const SeenFlight& seen) {
  constexpr std::array<const char*, 5> kNames{"initialising", "range-VIO", "VIO", "inertial", "failed"};
  const std::string mode = seen.outputs.empty() ? "none" : kNames[static_cast<std::size_t>(seen.outputs.back().mode)];
  const bool ranged = !range_bus().empty();
  return {.expected = ranged ? "ends in range-VIO" : "ends in VIO or initialising",
          .seen = "ends in " + mode,
          .passed = ranged ? mode == "range-VIO" : mode == "VIO" || mode == "initialising"};
}

std::string replayed(const fs::path& log) {
  for (const char* how : {"", " --raw"}) {
    const test::ProgramOutput run =
        test::output_of(std::string(PLUMB_REPLAY) + " --log " + log.string() + how + " 2>&1");
    if (run.exit_status != 0 || run.text.find(", all equal") == std::string::npos) return "not equal: " + run.text;
  }
  return "equal";
}

Finding has_all(const std::string& text, const Words& wanted, const std::string& expected) {
  for (const std::string& words : wanted) {
    if (text.find(words) == std::string::npos)
      return {.expected = expected, .seen = "not '" + words + "': " + text, .passed = false};
  }
  return compared(expected, expected);
}

// A disk of 8 MiB, in a mount namespace of its own, is full after some seconds.
Verdict disk_full(const fs::path& folder) {
  constexpr double kLength_s = 12.0;
  const EmulatedVehicle vehicle({.camera_socket = folder / "camera"}, kLongest_s);
  const fs::path disk = folder / "disk";
  fs::create_directory(disk);
  const std::string script = "mount -t tmpfs -o size=8m none \"$0\" && { \"$1\" \"$2\" --duration " +
                             std::to_string(kLength_s) +
                             " --log \"$0/flight.lcm\"; code=$?; cp \"$0/flight.lcm\" \"$3\"; exit $code; }";
  FlightProgram program({"unshare", "--map-root-user", "--mount", "sh", "-c", script, disk.string(), PLUMB_FSW,
                         write_configuration(folder, vehicle.imu_device()).string(), (folder / "kept.lcm").string()},
                        folder / "output");
  const int code = program.wait();
  const std::string output = program.output();
  // Nine seconds at least, at 200 ticks and 15 images a second.
  const bool flew = test::number_after(output, "ticks ") > 1800 && test::number_after(output, "images ") > 135;
  const std::string expected = "says how many records are lost and why, exit code 1";
  const bool told = test::number_after(output, ", lost ") > 0 && test::number_after(output, "not_written ") > 0 &&
                    output.find("the log ends before the flight: No space left on device") != std::string::npos;
  return {
      .modes = compared("flies to the end", flew ? "flies to the end" : output),
      .events = compared(expected, code == 1 && told ? expected : "exit code " + std::to_string(code) + ": " + output),
      .replay = compared("equal", replayed(folder / "kept.lcm"))};
}

Verdict killed(const fs::path& folder) {
  const EmulatedVehicle vehicle = vehicle_in(folder);
  const fs::path config = write_configuration(folder, vehicle.imu_device(), ranges_of_vehicle());
  const Words words = {PLUMB_FSW, config.string()};
  FlightProgram first(words, folder / "first");
  sleep_for(8.0);
  first.kill();
  FlightProgram second(words, folder / "second");
  sleep_for(12.0);
  const int code = second.stop();
  const SeenFlight seen = flight_in(folder / "flight-1.lcm", vehicle);
  const std::string before = replayed(folder / "flight.lcm");
  const std::string after = replayed(folder / "flight-1.lcm");
  return {.modes = ending_of(seen),
          .events = compared("a log of its own, exit code 0", fs::exists(folder / "flight-1.lcm") && code == 0
                                                                  ? "a log of its own, exit code 0"
                                                                  : second.output()),
          .error = error_of(seen),
          .replay = compared("equal", before == "equal" ? after : before)};
}

Verdict stopped_for_a_while(const fs::path& folder) {
  const EmulatedVehicle vehicle = vehicle_in(folder);
  FlightProgram program({PLUMB_FSW, write_configuration(folder, vehicle.imu_device(), ranges_of_vehicle()).string()},
                        folder / "output");
  sleep_for(8.0);
  program.send(SIGSTOP);
  sleep_for(1.5);
  program.send(SIGCONT);
  sleep_for(8.0);
  const int code = program.stop();
  const SeenFlight seen = flight_in(folder / "flight.lcm", vehicle);
  bool reset = false;
  for (const SeenEvent& event : seen.events) reset = reset || event.words == "filter reset";
  return {.modes = ending_of(seen),
          .events = compared("filter reset, exit code 0",
                             reset && code == 0 ? "filter reset, exit code 0" : "exit code " + std::to_string(code)),
          .error = error_of(seen),
          .replay = compared("equal", replayed(folder / "flight.lcm"))};
}

Verdict bad_parameters(const fs::path& folder) {
  const fs::path config = write_configuration(folder, "/dev/null",
                                              "parameters:\n  vision.pixel_noise: .nan\n  range.gate_sigma: -3\n"
                                              "  range.no_such: 1\n  imu.gravity: heavy\n");
  const test::ProgramOutput run = test::output_of(std::string(PLUMB_FSW) + " " + config.string() + " 2>&1");
  Finding named = has_all(run.text, {"vision.pixel_noise", "range.gate_sigma", "range.no_such", "imu.gravity"},
                          "all four named, exit code 2");
  if (run.exit_status != 2 << 8) named = {.expected = named.expected, .seen = run.text, .passed = false};
  const bool flew = fs::exists(folder / "flight.lcm");
  return {.modes = compared("does not fly", flew ? "a log is there" : "does not fly"), .events = named};
}

Verdict silent_imu(const fs::path& folder) {
  const EmulatedVehicle vehicle({.camera_socket = folder / "camera"}, kLongest_s);
  const hil::PseudoTerminal nobody;
  FlightProgram program({PLUMB_FSW, write_configuration(folder, nobody.device()).string()}, folder / "output");
  const int code = program.wait();
  Finding named = has_all(program.output(), {"imu: silent", "camera: speaks"}, "names the IMU, exit code 3");
  if (code != 3) named = {.expected = named.expected, .seen = program.output(), .passed = false};
  const bool flew = program.output().find("flying") != std::string::npos;
  return {.modes = compared("does not fly", flew ? "flies" : "does not fly"), .events = named};
}

Verdict no_room_for_the_log(const fs::path& folder) {
  const EmulatedVehicle vehicle({.camera_socket = folder / "camera"}, 1.0);
  const std::string log = (folder / "nowhere" / "flight.lcm").string();
  const test::ProgramOutput run =
      test::output_of(std::string(PLUMB_FSW) + " " + write_configuration(folder, vehicle.imu_device()).string() +
                      " --log " + log + " 2>&1");
  Finding named = has_all(run.text, {log, "No such file"}, "names the file and why, exit code 4");
  if (run.exit_status != 4 << 8) named = {.expected = named.expected, .seen = run.text, .passed = false};
  return {.modes = compared("does not fly", run.text.find("flying") == std::string::npos ? "does not fly" : "flies"),
          .events = named};
}

}  // namespace

std::vector<ProcessFault> process_faults() {
  return {{"bad-parameters", "a configuration with not-a-number, a value out of range, an unknown name and a word",
           bad_parameters},
          {"log-cannot-be-made", "the folder of the log is not there", no_room_for_the_log},
          {"start-without-imu", "the IMU says nothing for 10 s after the start", silent_imu},
          {"disk-full", "the disk of the log is full after 8 MiB", disk_full},
          {"process-stopped", "the whole process stands still for 1.5 s", stopped_for_a_while},
          {"process-killed", "the process is killed in the air and started again", killed}};
}

Verdict run_and_judge(const ProcessFault& fault, const std::filesystem::path& folder) {
  Verdict verdict = fault.run(folder);
  verdict.name = fault.name;
  verdict.what = fault.what;
  return verdict;
}

}  // namespace plumb::faults
