#include "tools/decode/lidar_lite_command.h"

#include <CLI/CLI.hpp>
#include <cinttypes>
#include <cstdio>
#include <map>
#include <string>

#include "config/arguments.h"
#include "drivers/lidar_lite/capture.h"
#include "tools/decode/bytes.h"
#include "tools/decode/i2c_trace.h"

namespace plumb::decode {
namespace {

using lidar_lite::Measurement;
using lidar_lite::Model;
using lidar_lite::Verdict;

const char* name_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::kRange: return "valid";
    case Verdict::kNoReturn: return "no_return";
    case Verdict::kWeak: return "weak";
    case Verdict::kNoReading: return "not_ready";
  }
  return "";
}

class LidarLiteCommand final : public Command {
 public:
  const char* name() const override { return "lidar-lite"; }
  const char* description() const override { return "transfers of a LIDAR-Lite's I2C bus, as the kernel traces them"; }
  void declare(CLI::App& app) override;
  bool run() override;

 private:
  std::string file_;
  Model model_ = Model::kV3;
  int address_ = lidar_lite::kAddress;
};

void LidarLiteCommand::declare(CLI::App& app) {
  const std::map<std::string, Model> models = {{"v3", Model::kV3}, {"v3hp", Model::kV3Hp}, {"v4led", Model::kV4Led}};
  app.add_option("FILE", file_, "trace of the bus; - for standard input")->required();
  app.add_option("--model", model_, "v3 (default), v3hp or v4led")->transform(one_of(models))->type_name("TEXT");
  app.add_option("--address", address_, "of the device, 7 bits (default 0x62)")->check(CLI::Range(0, 127));
  app.footer(
      "To record the bus while a program measures:\n"
      "  cd /sys/kernel/tracing && echo mono > trace_clock && echo 1 > events/i2c/enable\n"
      "  timeout 10 cat trace_pipe > FILE\n"
      "A row is a measurement; t_s is the middle of its acquisition by the clock of the trace.");
}

bool LidarLiteCommand::run() {
  std::istringstream lines = read_text(file_);
  I2cTrace trace(address_);
  lidar_lite::Capture capture(model_);
  std::uint64_t refused = 0;
  std::map<Verdict, std::uint64_t> measured;
  for (std::string line; std::getline(lines, line);) {
    const std::optional<I2cTransfer> taken = trace.take(line);
    if (!taken) continue;
    if (!taken->acknowledged) ++refused;
    lidar_lite::Transfer transfer{
        .t_stop = taken->t_stop, .is_read = taken->is_read, .acknowledged = taken->acknowledged, .bytes = {}};
    for (const std::uint8_t byte : taken->bytes) (void)transfer.bytes.push_back(byte);  // the device has no longer ones
    const Result<Measurement> measurement = capture.decode(transfer);
    if (!measurement) continue;
    if (measured.empty()) std::printf("t_s,distance_m,quality,strength,status\n");
    ++measured[measurement->interpreted.verdict];
    std::printf("%.6f,%.2f,%s,%d,%d\n", measurement->t.seconds(), measurement->interpreted.distance_cm * 0.01,
                name_of(measurement->interpreted.verdict), measurement->strength, measurement->status);
  }
  const I2cTraceCounters& counters = trace.counters();
  const bool has_measured = !measured.empty();
  if (!has_measured) tell_of_none(file_, "does the model fit, and did a program measure meanwhile?");
  std::fflush(stdout);  // the counts come last
  std::fprintf(stderr,
               "plumb-decode: %" PRIu64 " ranges, %" PRIu64 " without return, %" PRIu64 " weak, %" PRIu64
               " not ready, %" PRIu32 " never read; %" PRIu64 " transfers, %" PRIu64 " not acknowledged, %" PRIu64
               " other transfers, %" PRIu64 " lines that could not be read, %" PRIu64 " other lines\n",
               measured[Verdict::kRange], measured[Verdict::kNoReturn], measured[Verdict::kWeak],
               measured[Verdict::kNoReading], capture.unread(), counters.transfers, refused, counters.others,
               counters.malformed_lines, counters.other_lines);
  return has_measured;
}

}  // namespace

std::unique_ptr<Command> make_lidar_lite_command() { return std::make_unique<LidarLiteCommand>(); }

}  // namespace plumb::decode
