// plumb-montecarlo: flies the estimator over simulated scenes many times, with and without the range finder, and prints
// how accurate it was and whether its covariance told the truth. No images are made: features are projected landmarks.

#include <CLI/CLI.hpp>
#include <charconv>
#include <fstream>
#include <iostream>
#include <map>
#include <stdexcept>

#include "config/arguments.h"
#include "fsw/app/parameters.h"
#include "test/montecarlo/table.h"

namespace {

using namespace plumb;
using namespace plumb::sim;

struct Arguments {
  std::vector<std::string> scenes = {"outdoor_cruise", "outdoor_cruise_stepped"};
  CampaignSettings campaign;
  std::string imu = "stim300";
  std::string csv;
  std::vector<std::string> parameters;
  bool no_range = false;
  bool no_vio = false;
};

std::vector<std::string> all_scenes() { return {scene_names().begin(), scene_names().end()}; }

void declare_flight(CLI::App& app, Arguments& arguments) {
  FlightSettings& flight = arguments.campaign.flight;
  app.add_option("--imu", arguments.imu, "simulated IMU")
      ->check(CLI::IsMember({"stim300", "mems", "perfect"}))
      ->capture_default_str();
  app.add_option("--tracks", flight.tracker.target_tracks, "features followed at once")
      ->check(CLI::Range(3, 200))
      ->capture_default_str();
  app.add_option("--pixel-noise", flight.tracker.pixel_noise_px, "px, 1 sigma per axis")
      ->check(number_from(0.0, 100.0))
      ->capture_default_str();
  app.add_option("--outliers", flight.tracker.outlier, "probability that one observation is wrong")
      ->check(number_from(0.0, 1.0))
      ->capture_default_str();
  app.add_option("--mismatches", flight.tracker.mismatch, "probability per image that a track jumps for good")
      ->check(number_from(0.0, 1.0))
      ->capture_default_str();
  app.add_option("--dropouts", flight.tracker.dropout, "probability per image that a track ends")
      ->check(number_from(0.0, 1.0))
      ->capture_default_str();
  app.add_option("--range-noise", flight.range.noise_m, "m, 1 sigma")
      ->check(number_from(0.0, 100.0))
      ->capture_default_str();
  app.add_option("--range-outliers", flight.range.outlier, "probability of a false echo")
      ->check(number_from(0.0, 1.0))
      ->capture_default_str();
  app.add_option("--image-rate", flight.image_rate_hz, "Hz")->check(number_from(1.0, 120.0))->capture_default_str();
  app.add_option("--sun-rate", flight.sun.rate_hz, "Hz, of a sun sensor; 0: there is none")
      ->check(number_from(0.0, 100.0))
      ->capture_default_str();
  app.add_option("--sun-noise", flight.sun.noise_rad, "rad, 1 sigma per axis")
      ->check(number_from(0.0, 3.0))
      ->capture_default_str();
  app.add_option("--magnetometer-rate", flight.magnetometer.rate_hz, "Hz; 0: there is none")
      ->check(number_from(0.0, 100.0))
      ->capture_default_str();
  app.add_option("--magnetometer-noise", flight.magnetometer.noise_rad, "rad, 1 sigma per axis")
      ->check(number_from(0.0, 3.0))
      ->capture_default_str();
  app.add_flag("--from-truth", flight.start_from_truth, "hand the true state over at the start");
}

void declare_campaign(CLI::App& app, Arguments& arguments) {
  CampaignSettings& campaign = arguments.campaign;
  const std::map<std::string, Mission> missions = {
      {"flight", Mission::kFlight}, {"paper", Mission::kPaper}, {"calibrating", Mission::kCalibrating}};
  const std::map<std::string, Tuning> tunings = {{"matched", Tuning::kMatched}, {"shipped", Tuning::kShipped}};
  app.add_option("--scene", arguments.scenes, "scenes to fly, or 'all'");
  app.add_option("--seeds", campaign.runs, "flights per scene and filter")
      ->check(number_from(1, 1e6))
      ->capture_default_str();
  app.add_option("--first-seed", campaign.first_seed, "seed of the first flight")->capture_default_str();
  app.add_option("--jobs", campaign.jobs, "threads")->check(CLI::Range(1, 64))->capture_default_str();
  app.add_option("--config", campaign.mission, "compile-time configuration")
      ->transform(one_of(missions))
      ->option_text("flight|paper|calibrating [flight]");
  app.add_option("--tuning", campaign.tuning, "matched: the filter is told the simulated noise; shipped: its defaults")
      ->transform(one_of(tunings))
      ->option_text("matched|shipped [matched]");
  app.add_flag("--uncalibrated", campaign.uncalibrated,
               "sensors off by a draw of what one gets without calibration; '--config calibrating' estimates it");
  app.add_option("--set", arguments.parameters, "NAME=VALUE of an estimator parameter; wins over the tuning");
  app.add_flag("--no-range", arguments.no_range, "fly without the range finder only");
  app.add_flag("--no-vio", arguments.no_vio, "fly with the range finder only");
  app.add_option("--csv", arguments.csv, "also write one row per flight to this file");
}

ImuNoise imu_named(const std::string& name) {
  if (name == "mems") return mems_class();
  return name == "perfect" ? noise_free() : stim300_class();
}

void set_parameter(EstimatorOptions& options, const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos) throw std::invalid_argument("--set takes NAME=VALUE, not '" + text + "'");
  Parameters parameters;
  parameters.estimator = options;
  double value = 0.0;
  const char* end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data() + equals + 1, end, value);
  if (error != std::errc() || rest != end) throw std::invalid_argument("not a number: '" + text + "'");
  if (!ok(parameter_table().set(parameters, text.substr(0, equals), value).status))
    throw std::invalid_argument("no such parameter, or not such a value: '" + text + "'");
  options = parameters.estimator;
}

std::vector<Run> fly_with_progress(const Scene& scene, CampaignSettings settings, bool use_range) {
  settings.use_range = use_range;
  const auto progress = [&](int done) {
    std::cerr << '\r' << scene.name << (use_range ? ", range-VIO: " : ", VIO: ") << done << " of " << settings.runs
              << (done == settings.runs ? "          \n" : "          ") << std::flush;
  };
  return fly_campaign(scene, settings, progress);
}

int run(Arguments& arguments) {
  arguments.campaign.flight.imu = imu_named(arguments.imu);
  arguments.campaign.adjust = [&arguments](EstimatorOptions& options) {
    for (const std::string& text : arguments.parameters) set_parameter(options, text);
  };
  EstimatorOptions tried;
  arguments.campaign.adjust(tried);  // a wrong one is refused before anything flies
  if (arguments.scenes == std::vector<std::string>{"all"}) arguments.scenes = all_scenes();
  std::ofstream csv;
  if (!arguments.csv.empty()) {
    csv.open(arguments.csv);
    if (!csv) {
      std::cerr << "cannot write " << arguments.csv << '\n';
      return 1;
    }
    print_csv_header(csv);
  }
  for (const std::string& name : arguments.scenes) {
    const Scene scene = make_scene(name);
    SceneResult result;
    result.scene = name;
    if (!arguments.no_range) result.range_vio = fly_with_progress(scene, arguments.campaign, true);
    if (!arguments.no_vio) result.vio = fly_with_progress(scene, arguments.campaign, false);
    print_table(std::cout, result);
    std::cout << std::flush;
    if (csv.is_open()) print_csv_rows(csv, result);
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Flies the estimator over simulated scenes many times and judges its accuracy and its covariance.\n"
      "Same seeds, same figures, whatever the number of jobs.");
  Arguments arguments;
  arguments.campaign.jobs = 2;
  declare_campaign(app, arguments);
  declare_flight(app, arguments);
  std::string footer = "Scenes:";
  for (const std::string& name : all_scenes()) footer += " " + name;
  app.footer(footer);
  CLI11_PARSE(app, argc, argv);
  if (arguments.no_range && arguments.no_vio) {
    std::cerr << "--no-range and --no-vio together leave nothing to fly\n";
    return 1;
  }
  try {
    return run(arguments);
  } catch (const std::invalid_argument& error) {
    std::cerr << error.what() << ". " << footer << '\n';
    return 1;
  }
}
