// plumb-replay: flies a recording through the flight software. Exit code 0 done, 1 results that could not be written or
// an internal failure, 2 bad input, 3 a log that does not give the bits it was recorded with, 130 interrupted.

#include <CLI/CLI.hpp>
#include <cinttypes>
#include <csignal>
#include <cstdio>
#include <exception>
#include <memory>
#include <optional>
#include <string>

#include "config/input_error.h"
#include "fsw/base/assert.h"
#include "fsw/vision/vector_unit.h"
#include "tools/replay/asl_reader.h"
#include "tools/replay/flight.h"
#include "tools/replay/hash_check.h"
#include "tools/replay/live_telemetry.h"
#include "tools/replay/log_reader.h"
#include "tools/replay/outputs.h"
#include "tools/replay/pending_file.h"
#include "tools/replay/progress.h"
#include "tools/replay/recorder.h"
#include "tools/replay/summary.h"

namespace plumb::replay {
namespace {

constexpr int kExitFailed = 1;
constexpr int kExitBadInput = 2;
constexpr int kExitDifferent = 3;
constexpr int kExitInterrupted = 130;

volatile std::sig_atomic_t g_stop = 0;

void request_stop(int) { g_stop = 1; }

void print_assertion(const AssertSite& site) {
  std::fprintf(stderr, "plumb-replay: bug: %s line %d: %s does not hold\n", site.file, site.line, site.condition);
}

struct Arguments {
  std::string asl;
  std::string log;
  std::string lcm_url;
  std::string record;
  std::string parameters;
  std::string out;
  bool no_range = false;
  bool raw = false;
  bool list_parameters = false;
  FlightOptions flight;
};

/// When a change in flight counts.
const char* words_of(ParamChange change) {
  switch (change) {
    case ParamChange::kNever: return "never";
    case ParamChange::kAtStart: return "at the next start";
    case ParamChange::kInFlight: return "at once";
  }
  return "";
}

void list_parameters() {
  for (const ParamRow<Parameters>& row : parameter_table().rows()) {
    const std::string name(row.name);
    const std::string unit(row.unit);
    const std::string description(row.description);
    std::printf("%-30s %-10g [%g, %g] %s%s, %s: %s\n", name.c_str(), row.default_value, row.min, row.max, unit.c_str(),
                row.kind == ParamKind::kReal ? "" : ", whole", words_of(row.change), description.c_str());
  }
}

void declare(CLI::App& app, Arguments& arguments) {
  // An empty shell variable is a mistake, not the wish for no results.
  const CLI::Validator named([](const std::string& name) { return name.empty() ? "expected a name" : ""; }, "TEXT");
  app.add_option("--asl", arguments.asl, "recording in the ASL (EuRoC) layout: the folder that holds mav0")
      ->check(named);
  app.add_option("--log", arguments.log, "recording as an LCM event log, as written by --record")->check(named);
  app.add_option("--config", arguments.flight.config_name,
                 "compile-time sizes: paper, flight or calibrating (default: what the log was flown with, else flight)")
      ->check(CLI::IsMember(config_names()));
  app.add_option("--params", arguments.parameters, "YAML file of parameters; wins over the recording's sensor.yaml")
      ->check(named);
  app.add_flag("--no-range", arguments.no_range, "leave the range finder out");
  app.add_flag("--raw", arguments.raw, "with --log: from the bytes of the devices, through their drivers");
  app.add_flag("--start-from-truth", arguments.flight.start_from_truth,
               "start from the recording's truth at the first image (comparisons only)");
  app.add_flag("--realtime", arguments.flight.realtime, "as fast as it was recorded instead of as fast as possible");
  app.add_option("--out", arguments.out, "folder for trajectory.tum, states.csv, summary.json and others")
      ->check(named);
  app.add_option("--record", arguments.record, "write an LCM event log that --log flies again, bit by bit")
      ->check(named);
  app.add_option("--lcm", arguments.lcm_url, "publish over LCM, for example udpm://239.255.76.67:7667?ttl=0")
      ->check(named);
  app.add_flag("--list-params", arguments.list_parameters,
               "print every parameter with default, range, unit and when a change in flight counts");
}

// Collects what the output files need.
class OutputListener final : public FlightListener {
 public:
  explicit OutputListener(Outputs& outputs) : outputs_(outputs) {}
  void on_predicted(const PredictedState& state) override { outputs_.add_predicted(state); }
  void on_image(const ImageRecord& record) override { outputs_.add_image(record); }

 private:
  Outputs& outputs_;
};

std::unique_ptr<Source> open_source(const Arguments& arguments) {
  if (arguments.asl.empty() == arguments.log.empty()) {
    throw InputError("expected a recording: either --asl DIR or --log FILE (see --help)");
  }
  if (arguments.raw && arguments.log.empty()) throw InputError("--raw needs --log");
  if (!arguments.asl.empty()) {
    return open_asl({.folder = arguments.asl, .parameters = arguments.parameters, .use_range = !arguments.no_range});
  }
  return open_log({.file = arguments.log,
                   .parameters = arguments.parameters,
                   .use_range = !arguments.no_range,
                   .from_raw = arguments.raw});
}

std::string choose_config(const Arguments& arguments, const Session& session) {
  if (!arguments.flight.config_name.empty()) return arguments.flight.config_name;
  return session.config_name.empty() ? FlightConfig::kName : session.config_name;
}

void warn(const std::string& sentence) { std::fprintf(stderr, "plumb-replay: warning: %s\n", sentence.c_str()); }

// Flown as it was recorded, a log has to give the recorded bits.
int judge(const Arguments& arguments, const Session& session, const HashCheck& hashes) {
  const bool as_recorded = arguments.parameters.empty() && !arguments.no_range && !arguments.flight.start_from_truth &&
                           arguments.flight.config_name == session.config_name;
  if (!as_recorded || hashes.different() == 0) return 0;
  std::fprintf(stderr,
               "plumb-replay: %s: %" PRIu64 " of %" PRIu64
               " states differ from the recorded ones, first at image %" PRIu32
               "; the log was altered, or recorded by another version of the software\n",
               session.source.c_str(), hashes.different(), hashes.recorded(), *hashes.first_different());
  return kExitDifferent;
}

int replay(Arguments& arguments) {
  const std::unique_ptr<Source> source = open_source(arguments);
  const Session& session = source->session();
  FlightOptions& options = arguments.flight;
  options.config_name = choose_config(arguments, session);
  for (const std::string& warning : session.warnings) warn(warning);

  std::vector<FlightListener*> listeners;
  std::optional<Recorder> recorder;  // first in the list: inputs are logged before they are used
  if (!arguments.record.empty()) {
    listeners.push_back(&recorder.emplace(arguments.record, session, options.config_name));
  }
  std::optional<Outputs> outputs;
  std::optional<OutputListener> output_listener;
  if (!arguments.out.empty()) {
    outputs.emplace(arguments.out, session.inputs);
    listeners.push_back(&output_listener.emplace(*outputs));
  }
  std::optional<LiveTelemetry> telemetry;
  if (!arguments.lcm_url.empty()) listeners.push_back(&telemetry.emplace(arguments.lcm_url));
  HashCheck hashes(session);
  listeners.push_back(&hashes);
  FlightTotals totals;
  {
    Progress progress(session.images);
    listeners.push_back(&progress);
    totals = fly(*source, options, listeners);
  }
  if (recorder) recorder->commit();
  if (outputs) {
    outputs->set_summary(summary_json(session, options, totals, hashes));
    outputs->commit();
  }
  print_summary(session, options, totals, hashes);
  if (totals.images_valid == 0) {
    warn("no image got a state: the filter starts at rest, or in flight with ranges or a change of speed, and needs " +
         std::string("images with features and IMU samples about them"));
  }
  const EstimatorCounters& counters = totals.estimator;
  if (counters.ranges > 0 && counters.ranges == counters.ranges_invalid) {
    warn("every range was invalid: without echo, or beyond range.min_range and range.max_range, in metres");
  }
  if (telemetry && telemetry->lost() > 0) {
    const std::string count = std::to_string(telemetry->lost()) + " of " +
                              std::to_string(telemetry->lost() + telemetry->sent()) + " messages were refused";
    if (telemetry->sent() == 0) throw WriteError(arguments.lcm_url, count + " by LCM; is a server or a network there?");
    warn(arguments.lcm_url + ": " + count + " by LCM");
  }
  return judge(arguments, session, hashes);
}

int run(int argc, char** argv) {
  set_assert_handler(print_assertion);
  std::signal(SIGINT, request_stop);
  std::signal(SIGTERM, request_stop);
  std::signal(SIGHUP, request_stop);
  Arguments arguments;
  int exit_code = 0;
  arguments.flight.stop = &g_stop;
  CLI::App app("Flies a recording through the Plumb navigation software.", "plumb-replay");
  declare(app, arguments);
  try {
    if (!vector_unit_present()) throw InputError(kVectorAdvice);
    app.parse(argc, argv);
    if (arguments.list_parameters) {
      list_parameters();
    } else {
      exit_code = replay(arguments);
    }
    if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0) throw WriteError("standard output");
  } catch (const CLI::CallForHelp& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    std::fprintf(stderr, "plumb-replay: %s\n", error.what());
    return kExitBadInput;
  } catch (const InputError& error) {
    std::fprintf(stderr, "plumb-replay: %s\n", error.what());
    return kExitBadInput;
  } catch (const Interrupted& stopped) {
    std::fprintf(stderr, "plumb-replay: %s\n", stopped.what());
    return kExitInterrupted;
  } catch (const WriteError& error) {
    std::fprintf(stderr, "plumb-replay: %s\n", error.what());
    return kExitFailed;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "plumb-replay: internal failure: %s\n", error.what());
    return kExitFailed;
  }
  return exit_code;
}

}  // namespace
}  // namespace plumb::replay

int main(int argc, char** argv) { return plumb::replay::run(argc, argv); }
