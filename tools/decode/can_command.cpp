#include "tools/decode/can_command.h"

#include <CLI/CLI.hpp>
#include <cinttypes>
#include <cstdio>
#include <limits>
#include <map>
#include <string>

#include "config/arguments.h"
#include "drivers/can_range/candump.h"
#include "drivers/can_range/decoder.h"
#include "tools/decode/bytes.h"

namespace plumb::decode {
namespace {

using can_range::Protocol;
using can_range::Reading;

const char* name_of(RangeQuality quality) {
  switch (quality) {
    case RangeQuality::kValid: return "valid";
    case RangeQuality::kNoReturn: return "no_return";
    case RangeQuality::kWeak: return "weak";
  }
  return "";
}

class CanCommand final : public Command {
 public:
  const char* name() const override { return "can"; }
  const char* description() const override {
    return "frames of a CAN bus with a range finder, as candump -L writes them";
  }
  void declare(CLI::App& app) override;
  bool run() override;

 private:
  std::string file_;
  can_range::Options options_;
};

void CanCommand::declare(CLI::App& app) {
  const std::map<std::string, Protocol> protocols = {{"dronecan", Protocol::kDronecan},
                                                     {"benewake", Protocol::kBenewake}};
  app.add_option("FILE", file_, "output of candump -L; - for standard input")->required();
  app.add_option("--protocol", options_.protocol, "dronecan (default) or benewake")
      ->transform(one_of(protocols))
      ->type_name("TEXT");
  app.add_option("--node", options_.node_id, "DroneCAN: the node to listen to (default: any)")
      ->check(CLI::Range(1, 127));
  app.add_option("--sensor", options_.sensor_id, "DroneCAN: the sensor of that node (default: any)")
      ->check(CLI::Range(0, 255));
  app.add_option("--id", options_.benewake_id, "Benewake: identifier of its frame (default 3)")
      ->check(CLI::Range(0, static_cast<int>(kCanStandardIdMask)));
  constexpr int kMaxWord = std::numeric_limits<std::uint16_t>::max();
  app.add_option("--far-cm", options_.benewake_far_cm,
                 "Benewake: distance from which on there is no return (default 18000)")
      ->check(CLI::Range(static_cast<int>(can_range::kMinBenewakeFar_cm), kMaxWord));
  app.add_option("--min-strength", options_.benewake_min_strength,
                 "Benewake: strength below which a return is weak (default 1)")
      ->check(CLI::Range(0, kMaxWord));
  app.add_option("--bitrate", options_.bus_bit_s, "of the bus in bit/s (default 1000000)")
      ->check(CLI::Range(10'000, 1'000'000));
  app.footer(
      "To record the bus:\n"
      "  timeout 10 candump -L can0 > FILE\n"
      "A row is a measurement; t_s is its time by the stamps of candump, less the frame's time on the bus.");
}

bool CanCommand::run() {
  std::istringstream lines = read_text(file_);
  can_range::Decoder decoder(options_);
  std::uint64_t frames = 0;
  std::uint64_t other_lines = 0;
  std::uint64_t readings = 0;
  for (std::string line; std::getline(lines, line);) {
    const Result<ReceivedCanFrame> frame = can_range::parse_candump_line(line);
    if (!frame) {
      ++other_lines;
      continue;
    }
    ++frames;
    const Result<Reading> reading = decoder.decode(*frame);
    if (!reading) continue;
    if (readings++ == 0) std::printf("t_s,node,sensor,range_m,quality\n");
    std::printf("%.6f,%d,%d,%.9g,%s\n", reading->sample.t.seconds(), reading->node_id, reading->sensor_id,
                reading->sample.range_m, name_of(reading->sample.quality));
  }
  if (readings == 0) tell_of_none(file_, "do protocol, node and identifier fit?");
  std::fflush(stdout);  // the counts come last
  const can_range::Counters& counters = decoder.counters();
  const can_range::TransferCounters& transfers = decoder.transfer_counters();
  std::fprintf(stderr,
               "plumb-decode: %" PRIu32 " ranges, %" PRIu32 " without return, %" PRIu32 " weak; %" PRIu64
               " frames, %" PRIu64 " malformed, %" PRIu32 " of other sensors, %" PRIu64 " checksum errors, %" PRIu64
               " transfers broken off, %" PRIu64 " missing, %" PRIu64 " other lines\n",
               counters.ranges, counters.no_returns, counters.weak, frames, counters.malformed.count,
               counters.other_sensors, transfers.crc_errors.count,
               transfers.wrong_toggle + transfers.orphans + transfers.abandoned, transfers.missing.count, other_lines);
  return readings > 0;
}

}  // namespace

std::unique_ptr<Command> make_can_command() { return std::make_unique<CanCommand>(); }

}  // namespace plumb::decode
