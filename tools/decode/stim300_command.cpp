#include "tools/decode/stim300_command.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cinttypes>
#include <cstdio>
#include <map>
#include <optional>
#include <string>

#include "config/input_error.h"
#include "drivers/stim300/configuration.h"
#include "drivers/stim300/datagram.h"
#include "drivers/stim300/framer.h"
#include "tools/decode/bytes.h"
#include "tools/stim300_setup/unit_option.h"

namespace plumb::decode {
namespace {

using namespace stim300;

constexpr double kCelsiusPerCount = 1.0 / 256.0;

struct Column {
  ClusterId id;
  const char* name;
  const char* unit;
  bool single;
};
// Inclinometer and PPS are in counts: the configuration leaves their unit open.
constexpr std::array<Column, kClusterCount> kColumns = {{
    {ClusterId::kGyro, "gyro", "rad_s", false},
    {ClusterId::kAccel, "accel", "m_s2", false},
    {ClusterId::kInclinometer, "incl", "counts", false},
    {ClusterId::kGyroTemperature, "gyro_temperature", "degC", false},
    {ClusterId::kAccelTemperature, "accel_temperature", "degC", false},
    {ClusterId::kInclinometerTemperature, "incl_temperature", "degC", false},
    {ClusterId::kPps, "pps", "counts", true},
}};

// What has to be known before a number can be printed.
struct Overview {
  std::optional<Settings> told;        ///< by the last configuration datagram
  std::string serial_number;           ///< empty: not told
  std::optional<Layout> first;         ///< of the normal datagrams
  std::map<int, std::uint64_t> steps;  ///< of the counter, and how often
  std::uint64_t normal = 0;
  std::uint64_t starting = 0;
  FramerCounters line;
};

class Stim300Command final : public Command {
 public:
  const char* name() const override { return "stim300"; }
  const char* description() const override { return "bytes of a STIM300's serial line"; }
  void declare(CLI::App& app) override;
  bool run() override;

 private:
  template <typename Sink>
  FramerCounters for_each_frame(Sink sink) const;
  Overview look_through() const;
  int rate_hz(const Overview& overview) const;
  Settings settle(const Overview& overview) const;
  void print_row(const Datagram& datagram, const Layout& columns, std::int64_t ticks, const Settings& settings) const;

  std::string file_;
  std::vector<std::uint8_t> bytes_;
  std::optional<int> accel_range_g_;
  std::optional<Unit> gyro_unit_;
  std::optional<Unit> accel_unit_;
  std::optional<int> rate_hz_;
};

void Stim300Command::declare(CLI::App& app) {
  app.add_option("FILE", file_, "captured bytes, from any place in the stream; - for standard input")->required();
  app.add_option("--accel-range", accel_range_g_, "range of the accelerometers in g, printed on the unit")
      ->check(CLI::IsMember({5, 10, 30, 80}));
  add_unit_option(app, "--gyro-unit", gyro_unit_, kGyroUnitNames, "what the gyros tell: rate, increment or average");
  add_unit_option(app, "--accel-unit", accel_unit_, kAccelUnitNames,
                  "what the accelerometers tell: acceleration, increment or average");
  app.add_option("--rate", rate_hz_, "datagrams a second that the unit is set to")
      ->check(CLI::IsMember({125, 250, 500, 1000, 2000}));
  app.footer(
      "The four options stand for the configuration that a unit tells at power-on or when asked, if the capture has "
      "none. Without --rate the rate is then that of most steps of the unit's counter.\n"
      "A row is a datagram; t_s counts from the first one by the unit's own counter, filter delays not taken off. "
      "Status\n"
      "bits: 128 integrity error, 64 starting, 32 outside conditions, 16 overload, 8 channel error, 4 Z, 2 Y, 1 X.");
}

template <typename Sink>
FramerCounters Stim300Command::for_each_frame(Sink sink) const {
  Framer framer;
  Frame frame;
  for (const std::uint8_t byte : bytes_) {
    framer.push(byte, Time());
    while (framer.next(frame)) sink(frame.bytes);
  }
  framer.finish();
  while (framer.next(frame)) sink(frame.bytes);
  return framer.counters();
}

Overview Stim300Command::look_through() const {
  Overview overview;
  std::optional<std::uint8_t> last;
  overview.line = for_each_frame([&](std::span<const std::uint8_t> bytes) {
    if (const Result<Settings> told = decode_configuration(bytes)) overview.told = *told;
    if (const Result<SerialNumber> number = decode_serial_number(bytes)) {
      overview.serial_number.assign(number->begin(), number->end());
    }
    const Result<Datagram> datagram = stim300::decode(bytes);
    if (!datagram) return;
    ++overview.normal;
    if (((*datagram)[ClusterId::kGyro].status & kStatusStarting) != 0) ++overview.starting;
    if (!overview.first) overview.first = datagram->layout;
    if (last) ++overview.steps[static_cast<std::uint8_t>(datagram->counter - *last)];
    last = datagram->counter;
  });
  return overview;
}

// Of most steps of the counter; 0: it made none.
int usual_rate_hz(const Overview& overview) {
  int usual = 0;
  std::uint64_t most = 0;
  for (const auto& [step, times] : overview.steps) {
    if (step == 0 || times <= most) continue;
    usual = step;
    most = times;
  }
  return usual == 0 ? 0 : std::max(kInternalRate_hz / usual, 1);
}

// As told, as given, or else as the counter says; 0: it does not.
int Stim300Command::rate_hz(const Overview& overview) const {
  if (overview.told && overview.told->rate_hz != 0) return overview.told->rate_hz;
  return rate_hz_.value_or(usual_rate_hz(overview));
}

// What the capture tells wins; an option that says otherwise is a mistake of one of the two.
Settings Stim300Command::settle(const Overview& overview) const {
  Settings settings = overview.told.value_or(
      Settings{.rate_hz = 0, .gyro_unit = Unit::kInstant, .accel_unit = Unit::kInstant, .accel_range_g = 0});
  std::string missing;
  const auto miss = [&](const char* option) { missing += (missing.empty() ? "" : ", ") + std::string(option); };
  const auto choose = [&](const char* option, auto& told, bool is_told, const auto& given) {
    if (!is_told && !given) miss(option);
    if (is_told && given && *given != told) {
      throw InputError(file_ + ": " + option + " is not what the unit told of itself");
    }
    if (given) told = *given;
  };
  choose("--gyro-unit", settings.gyro_unit, overview.told.has_value(), gyro_unit_);
  choose("--accel-unit", settings.accel_unit, overview.told.has_value(), accel_unit_);
  choose("--accel-range", settings.accel_range_g, settings.accel_range_g != 0, accel_range_g_);
  if (settings.gyro_unit == Unit::kIntegral || settings.accel_unit == Unit::kIntegral) {
    throw InputError(file_ + ": the unit is set to integrated angle or velocity, which is not supported");
  }
  if (rate_hz_ && settings.rate_hz != 0 && *rate_hz_ != settings.rate_hz) {
    throw InputError(file_ + ": --rate is not what the unit told of itself");
  }
  settings.rate_hz = rate_hz(overview);
  const bool increments = settings.gyro_unit == Unit::kIncrement || settings.accel_unit == Unit::kIncrement;
  if (settings.rate_hz == 0 && increments) miss("--rate (a single measurement does not tell what to divide by)");
  if (!missing.empty()) {
    throw InputError(file_ + ": the capture does not tell how the unit is set up; give " + missing +
                     ", or capture from power-on");
  }
  return settings;
}

void print_header(const Layout& layout) {
  std::printf("t_s,counter,latency_us");
  for (const Column& column : kColumns) {
    if (!layout.has(column.id)) continue;
    if (column.single) {
      std::printf(",%s_%s", column.name, column.unit);
    } else {
      for (const char axis : {'x', 'y', 'z'}) std::printf(",%s_%c_%s", column.name, axis, column.unit);
    }
    std::printf(",%s_status", column.name);
  }
  std::printf("\n");
}

void Stim300Command::print_row(const Datagram& datagram, const Layout& columns, std::int64_t ticks,
                               const Settings& settings) const {
  std::printf("%.4f,%d,%d", static_cast<double>(ticks) / kInternalRate_hz, datagram.counter, datagram.latency_us);
  for (const Column& column : kColumns) {
    if (!columns.has(column.id)) continue;
    const std::size_t numbers = column.single ? 1 : 3;
    if (!datagram.layout.has(column.id)) {  // the unit was set up anew within the capture
      std::printf("%s", column.single ? ",," : ",,,,");
      continue;
    }
    const Cluster& cluster = datagram[column.id];
    double scale = kCelsiusPerCount;
    if (column.id == ClusterId::kGyro) scale = gyro_scale_rad_s(settings);
    if (column.id == ClusterId::kAccel) scale = accel_scale_m_s2(settings);
    if (column.id == ClusterId::kInclinometer || column.id == ClusterId::kPps) scale = 1.0;
    for (std::size_t i = 0; i < numbers; ++i) std::printf(",%.9g", cluster.raw[i] * scale);
    std::printf(",%d", cluster.status);
  }
  std::printf("\n");
}

void print_counts(const Overview& overview, int rate_hz) {
  std::string rate;
  if (overview.normal > 0) {
    rate = rate_hz == 0 ? " at a rate that is not known" : " at " + std::to_string(rate_hz) + " Hz";
  }
  const int usual = rate_hz == 0 ? 1 : std::max(kInternalRate_hz / rate_hz, 1);
  std::uint64_t gaps = 0;
  std::uint64_t missing = 0;
  for (const auto& [step, times] : overview.steps) {
    if (step != usual) gaps += times;
    if (step > usual) missing += times * static_cast<std::uint64_t>(step / usual - 1);
  }
  std::fflush(stdout);  // the counts come last
  std::fprintf(stderr,
               "plumb-decode: %" PRIu64 " measurements%s (%" PRIu64 " starting), %" PRIu64 " other datagrams, %" PRIu64
               " checksum errors, %" PRIu64 " bytes skipped, %" PRIu64 " gaps (%" PRIu64 " datagrams missing)\n",
               overview.normal, rate.c_str(), overview.starting, overview.line.datagrams - overview.normal,
               overview.line.checksum_errors.count, overview.line.skipped_bytes.count, gaps, missing);
}

bool Stim300Command::run() {
  bytes_ = read_bytes(file_);
  const Overview overview = look_through();
  if (overview.normal == 0) {
    tell_of_none(file_, "was the line captured at the speed that the unit is set to?");
    print_counts(overview, 0);
    return false;
  }
  Settings settings;
  try {
    settings = settle(overview);
  } catch (const InputError& error) {  // that the unit talks is worth telling all the same
    std::fprintf(stderr, "plumb-decode: %s\n", error.what());
    print_counts(overview, rate_hz(overview));
    return false;
  }
  print_header(*overview.first);
  std::int64_t ticks = 0;
  std::optional<std::uint8_t> last;
  for_each_frame([&](std::span<const std::uint8_t> bytes) {
    const Result<Datagram> datagram = stim300::decode(bytes);
    if (!datagram) return;
    if (last) ticks += static_cast<std::uint8_t>(datagram->counter - *last);
    last = datagram->counter;
    print_row(*datagram, *overview.first, ticks, settings);
  });
  if (!overview.serial_number.empty()) {
    std::fprintf(stderr, "plumb-decode: serial number %s\n", overview.serial_number.c_str());
  }
  print_counts(overview, settings.rate_hz);
  return true;
}

}  // namespace

std::unique_ptr<Command> make_stim300_command() { return std::make_unique<Stim300Command>(); }

}  // namespace plumb::decode
