// plumb-hil: a recorded flight out of this host's interfaces. Exit code 0 played, 1 an internal failure, 2 bad input,
// 130 interrupted.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <exception>
#include <memory>
#include <string>
#include <vector>

#include "config/arguments.h"
#include "config/input_error.h"
#include "hal/linux/linux_clock.h"
#include "tools/hil/player.h"

namespace plumb::hil {
namespace {

constexpr int kExitFailed = 1;
constexpr int kExitBadInput = 2;
constexpr int kExitInterrupted = 130;

// What waits in a pseudo-terminal is lost when this end closes: time for the other to read it.
constexpr Duration kLinger = Duration::from_ms(200);

std::atomic<bool> g_stop{false};
void request_stop(int) { g_stop.store(true); }

struct Arguments {
  std::string log;
  std::string serial;
  std::string pty;
  std::string can;
  std::string i2c;
  std::string video;
  std::uint32_t baud = 921600;
  double rate = 1.0;
  double delay_s = 0.0;
};

constexpr double kLongestDelay_s = 1e6;

void declare(CLI::App& app, Arguments& arguments) {
  app.add_option("LOG", arguments.log, "log with what devices said, of plumb-fsw or tools/simulate")->required();
  CLI::Option* serial =
      app.add_option("--serial", arguments.serial, "serial line that the STIM300's bytes go out of, as /dev/ttyUSB0");
  app.add_option("--baud", arguments.baud, "its speed in bit/s (default 921600)")->needs(serial);
  app.add_option("--pty", arguments.pty, "link to a pseudo-terminal that is made for them in place of a serial line")
      ->excludes(serial);
  app.add_option("--can", arguments.can, "interface that CAN frames go out of, as can0");
  app.add_option("--i2c", arguments.i2c,
                 "memory of an I2C device that this host is, as /sys/bus/i2c/devices/1-1062/slave-eeprom");
  app.add_option("--video", arguments.video, "v4l2loopback device that images are written to, as /dev/video9");
  app.add_option("--rate", arguments.rate, "seconds of the log in one second (default 1)")
      ->check(number_from(0.01, 100.0));
  app.add_option("--delay", arguments.delay_s, "seconds between opening the interfaces and playing (default 0)")
      ->check(number_from(0.0, kLongestDelay_s));
  app.footer(
      "What has no interface given is not played. Every message goes out when the recording's host had it; what an\n"
      "interface does not take at once is dropped and counted. At another --rate than 1 the devices seem slower or\n"
      "faster than they are, so that motion is not what the flight computer should find.");
}

std::vector<std::unique_ptr<Output>> open_outputs(const Arguments& arguments, const Contents& contents) {
  std::vector<std::unique_ptr<Output>> outputs;
  if (!arguments.serial.empty()) outputs.push_back(open_serial(arguments.serial, arguments.baud));
  if (!arguments.pty.empty()) outputs.push_back(make_pseudo_terminal(arguments.pty));
  if (!arguments.can.empty()) outputs.push_back(open_can(arguments.can));
  if (!arguments.i2c.empty()) outputs.push_back(open_registers(arguments.i2c));
  if (!arguments.video.empty()) {
    outputs.push_back(open_video(arguments.video, contents.camera.width, contents.camera.height));
  }
  if (outputs.empty()) throw InputError("no interface is given; expected --serial, --pty, --can, --i2c or --video");
  for (const std::unique_ptr<Output>& output : outputs) {
    if (contents.messages.contains(output->channel())) continue;
    throw InputError(arguments.log + ": has nothing for " + output->place() + "; expected channel " +
                     output->channel());
  }
  return outputs;
}

void print(const PlayReport& report, const std::vector<std::unique_ptr<Output>>& outputs, double rate) {
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    const Account& account = report.accounts[i];
    std::printf("%-12s %s: played %llu, dropped %llu, not understood %llu, lag mean %.3f ms, longest %.3f ms\n",
                outputs[i]->channel(), outputs[i]->place().c_str(), static_cast<unsigned long long>(account.played),
                static_cast<unsigned long long>(account.dropped), static_cast<unsigned long long>(account.invalid),
                1e3 * account.lag_mean().seconds(), 1e3 * account.lag_most.seconds());
  }
  const double pace = report.taken > Duration() ? report.recorded.seconds() / report.taken.seconds() : 0.0;
  std::printf("pace         %.3f s of the log in %.3f s, %.4f times what was asked for\n", report.recorded.seconds(),
              report.taken.seconds(), pace / rate);
}

int play_log(const Arguments& arguments) {
  const Contents contents = contents_of(arguments.log);
  const std::vector<std::unique_ptr<Output>> outputs = open_outputs(arguments, contents);
  for (const std::unique_ptr<Output>& output : outputs) {
    std::printf("%-12s %zu messages to %s\n", output->channel(), contents.messages.at(output->channel()),
                output->place().c_str());
  }
  for (const auto& [name, count] : contents.messages) {
    const bool is_played =
        std::any_of(outputs.begin(), outputs.end(), [&name](const auto& output) { return name == output->channel(); });
    if (!is_played) std::printf("%-12s %zu messages are not played\n", name.c_str(), count);
  }
  std::fflush(stdout);
  LinuxClock clock;
  const auto wait = [&clock](Duration time) {
    for (const Time end = clock.now() + time; clock.now() < end && !g_stop;) clock.wait_until(end);  // or to a signal
  };
  wait(Duration::from_seconds(arguments.delay_s));
  const PlayReport report = play(arguments.log, contents, outputs, arguments.rate, g_stop);
  wait(kLinger);
  print(report, outputs, arguments.rate);
  return report.interrupted ? kExitInterrupted : 0;
}

int run(int argc, char** argv) {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) std::signal(signal, request_stop);
  Arguments arguments;
  CLI::App app(
      "Plays a recorded flight out of this host's interfaces, for a flight computer that is connected to them.",
      "plumb-hil");
  declare(app, arguments);
  try {
    app.parse(argc, argv);
    return play_log(arguments);
  } catch (const CLI::CallForHelp& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    std::fprintf(stderr, "plumb-hil: %s\n", error.what());
    return kExitBadInput;
  } catch (const InputError& error) {
    std::fprintf(stderr, "plumb-hil: %s\n", error.what());
    return kExitBadInput;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "plumb-hil: internal failure: %s\n", error.what());
    return kExitFailed;
  }
}

}  // namespace
}  // namespace plumb::hil

int main(int argc, char** argv) { return plumb::hil::run(argc, argv); }
