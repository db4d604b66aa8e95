// plumb-stim300-setup: sets a STIM300 up as the flight expects it, and asks the unit what it is then. Exit code 0 it is
// as wanted; 1 the unit refused, did not answer, or is otherwise; 2 bad options, or the line cannot be opened.

#include <poll.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cstdio>
#include <memory>
#include <string>

#include "drivers/stim300/device.h"
#include "drivers/stim300/service_setup.h"
#include "hal/linux/monotonic_clock.h"
#include "hal/linux/serial_port.h"
#include "tools/stim300_setup/unit_option.h"

namespace plumb {
namespace {

constexpr int kExitFailed = 1;
constexpr int kExitBadInput = 2;
constexpr Duration kStep = Duration::from_ms(10);
// The whole dialogue takes about half a second; the unit starts anew when it leaves its Service mode.
constexpr Duration kSetupTimeout = Duration::from_ms(30'000);
constexpr Duration kCheckTimeout = Duration::from_ms(10'000);

struct Arguments {
  std::string device;
  stim300::Settings settings;
  bool save = false;
  bool check = false;
};

template <std::size_t N>
CLI::IsMember used_of(const std::array<int, N>& values) {
  std::vector<int> usable;
  for (const int value : values) {
    if (value > 0) usable.push_back(value);
  }
  return CLI::IsMember(usable);
}

void declare(CLI::App& app, Arguments& arguments) {
  stim300::Settings& settings = arguments.settings;
  app.add_option("DEVICE", arguments.device, "serial line, for example /dev/ttyUSB0")->required();
  app.add_flag("--check", arguments.check, "only ask the unit what it is set up to, and compare");
  app.add_flag("--save", arguments.save, "also into the unit's flash memory, which takes 10 000 times");
  app.add_option("--baud", settings.baud, "speed of the line in bit/s, which stays (default 921600)")
      ->check(CLI::Range(1'500U, 5'184'000U));
  app.add_option("--rate", settings.rate_hz, "datagrams a second (default 250)")->check(used_of(stim300::kRates_hz));
  add_unit_option(app, "--gyro-unit", settings.gyro_unit, stim300::kGyroUnitNames,
                  "what the gyros tell: rate, increment (default) or average");
  add_unit_option(app, "--accel-unit", settings.accel_unit, stim300::kAccelUnitNames,
                  "what the accelerometers tell: acceleration, increment (default) or average");
  app.add_option("--gyro-delayed", settings.gyro_delayed, "gyros as late as the accelerometers (default true)");
  app.add_option("--gyro-filter", settings.gyro_filter_hz, "low-pass in Hz (default 262)")
      ->check(used_of(stim300::kFilters_hz));
  app.add_option("--accel-filter", settings.accel_filter_hz, "low-pass in Hz (default 262)")
      ->check(used_of(stim300::kFilters_hz));
  app.add_option("--accel-range", settings.accel_range_g, "in g, printed on the unit; cannot be set (default 10)")
      ->check(CLI::IsMember({5, 10, 30, 80}));
  app.add_flag("--temperatures", settings.temperatures, "datagrams also have temperatures");
  app.add_flag("--inclinometer", settings.inclinometer, "datagrams also have the inclinometer");
  app.add_flag("--pps", settings.pps, "datagrams also have the PPS input");
  app.add_flag("--cr-lf", settings.cr_lf, "CR LF after each datagram");
  app.footer(
      "Without --save a unit that is reset is as it was before. The defaults are what the flight software expects.");
}

/// Exit code.
int set_up(SerialPort& port, const Arguments& arguments) {
  stim300::ServiceSetup setup(arguments.settings, arguments.save);
  std::array<std::uint8_t, stim300::kMaxChunkBytes> buffer{};
  for (const Time deadline = clock_now() + kSetupTimeout;
       setup.status() == Status::kNotReady && clock_now() < deadline;) {
    const Result<SerialChunk> chunk = port.read(buffer, kStep);
    if (chunk) setup.receive(std::span(buffer).first(chunk->size), chunk->t);
    const stim300::ServiceSetup::Command command = setup.poll(clock_now());
    const bool lost = chunk.status() == Status::kRejected ||
                      (!command.empty() && !ok(port.write({command.data(), command.size()}, kStep)));
    if (!lost) continue;
    std::fprintf(stderr, "plumb-stim300-setup: %s: the line failed\n", arguments.device.c_str());
    return kExitFailed;
  }
  if (ok(setup.status())) return 0;
  const std::string command(setup.command().begin(), setup.command().end());
  const std::string name = command.substr(0, command.find('\r'));
  if (setup.status() == Status::kRejected) {
    std::fprintf(stderr, "plumb-stim300-setup: %s: the unit refused \"%s\" with error %03d\n", arguments.device.c_str(),
                 name.c_str(), setup.error_code());
  } else {
    std::fprintf(stderr, "plumb-stim300-setup: %s: no answer to \"%s\"; is %u bit/s the unit's speed?\n",
                 arguments.device.c_str(), name.c_str(), arguments.settings.baud);
  }
  return kExitFailed;
}

std::string value_of(const stim300::Difference& difference, std::int64_t value) {
  if (difference.names != nullptr) return difference.names->at(static_cast<std::size_t>(value));
  return std::to_string(value);
}

/// Exit code.
int check(SerialPort& port, const Arguments& arguments) {
  stim300::Device unit(port, arguments.settings);
  stim300::Samples samples;
  const Time deadline = clock_now() + kCheckTimeout;
  while (unit.protocol().state() == stim300::State::kUnconfigured && clock_now() < deadline) {
    if (unit.poll(clock_now(), kStep, samples) == Status::kRejected) break;
  }
  switch (unit.protocol().state()) {
    case stim300::State::kConfigured:
      std::printf("%s: the unit is set up as wanted\n", arguments.device.c_str());
      return 0;
    case stim300::State::kUnconfigured:
      std::fprintf(stderr, "plumb-stim300-setup: %s: the unit does not tell how it is set up; is %u bit/s its speed?\n",
                   arguments.device.c_str(), arguments.settings.baud);
      return kExitFailed;
    case stim300::State::kRefused: break;
  }
  for (const stim300::Difference& difference : unit.protocol().differences()) {
    std::fprintf(stderr, "plumb-stim300-setup: %s: %s is %s, wanted is %s\n", arguments.device.c_str(), difference.name,
                 value_of(difference, difference.actual).c_str(), value_of(difference, difference.expected).c_str());
  }
  if (unit.protocol().differences().empty()) {
    std::fprintf(stderr, "plumb-stim300-setup: %s: the unit is set up in a way that is not known here\n",
                 arguments.device.c_str());
  }
  return kExitFailed;
}

int run(int argc, char** argv) {
  Arguments arguments;
  CLI::App app("Sets a STIM300 up as the flight expects it, and asks the unit what it is then.", "plumb-stim300-setup");
  declare(app, arguments);
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    std::fprintf(stderr, "plumb-stim300-setup: %s\n", error.what());
    return kExitBadInput;
  }
  if (!stim300::is_usable(arguments.settings)) {
    std::fprintf(stderr,
                 "plumb-stim300-setup: at %u bit/s the line is too slow for these datagrams %d times a second\n",
                 arguments.settings.baud, arguments.settings.rate_hz);
    return kExitBadInput;
  }
  std::string error;
  const std::unique_ptr<LinuxSerialPort> port =
      LinuxSerialPort::open(arguments.device, {.baud = arguments.settings.baud}, error);
  if (port == nullptr) {
    std::fprintf(stderr, "plumb-stim300-setup: %s\n", error.c_str());
    return kExitBadInput;
  }
  if (!arguments.check) {
    if (const int failed = set_up(*port, arguments); failed != 0) return failed;
  }
  return check(*port, arguments);
}

}  // namespace
}  // namespace plumb

int main(int argc, char** argv) { return plumb::run(argc, argv); }
