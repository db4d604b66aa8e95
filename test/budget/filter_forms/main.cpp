// plumb-filter-forms: the covariance form of the filter against its square-root form, in float64 and float32.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <exception>
#include <numeric>
#include <optional>

#include "config/arguments.h"
#include "config/input_error.h"
#include "fsw/app/nav_system.h"
#include "fsw/vision/flight_tracker.h"
#include "test/budget/filter_forms/comparison.h"
#include "test/budget/filter_forms/operation_recorder.h"
#include "test/budget/filter_forms/root_form.h"
#include "test/budget/instruction_mark.h"
#include "tools/replay/asl_reader.h"

namespace plumb::budget {
namespace {

constexpr const char* kAbout =
    "Flies a recording, records what the filter does to its covariance, and repeats that in other forms of the filter: "
    "the covariance in float32, its square root in float64 and float32. Prints for each form the time of an image (the "
    "shortest of the rounds), its ratio to the kernels that fly, the largest errors of the corrections K r (in sigma) "
    "and of the sigmas (relative) against the covariance form in long double (median and worst image), the smallest "
    "eigenvalue of the correlations, the images whose covariance was not positive definite, and updates that failed. "
    "Every form is given the Jacobians and residuals of the flight as flown, so what is compared is one pass of "
    "rounding errors through the whole flight, not the flights that would follow from them.";

using Contestants = std::vector<std::unique_ptr<Contestant>>;

Contestants contestants() {
  Contestants all;
  all.push_back(std::make_unique<FormContestant<FlownForm>>("covariance, float64, as flown"));
  all.push_back(std::make_unique<FormContestant<CovarianceForm<double>>>("covariance, float64"));
  all.push_back(std::make_unique<FormContestant<CovarianceForm<float>>>("covariance, float32"));
  const auto add_root = [&all]<typename T, RootUpdate update>(const char* name) {
    all.push_back(std::make_unique<FormContestant<RootForm<T, update>>>(name));
  };
  add_root.operator()<double, RootUpdate::kHouseholder>("square root by Householder, float64");
  add_root.operator()<float, RootUpdate::kHouseholder>("square root by Householder, float32");
  add_root.operator()<double, RootUpdate::kCholesky>("square root by Cholesky, float64");
  add_root.operator()<float, RootUpdate::kCholesky>("square root by Cholesky, float32");
  return all;
}

/// Throws when the operations do not give the covariance of the flight: then one was not recorded.
void check_complete(const Table<long double>& repeated, ConstMatrixView flown) {
  constexpr long double kRounding = 1e-6L;  // of the two sigmas; what is missing shows as far more
  for (std::size_t r = 0; r < flown.rows(); ++r) {
    for (std::size_t c = 0; c < flown.cols(); ++c) {
      const long double sigmas = std::sqrt(static_cast<long double>(flown(r, r)) * flown(c, c));
      if (std::abs(repeated(index(r), index(c)) - flown(r, c)) <= kRounding * sigmas) continue;
      throw std::runtime_error("the recorded operations do not give the covariance as flown, at " + std::to_string(r) +
                               ", " + std::to_string(c));
    }
  }
}

bool any_of(const std::vector<Operation<double>>& operations, Kind kind) {
  return std::any_of(operations.begin(), operations.end(), [kind](const auto& o) { return o.kind == kind; });
}

struct Options {
  std::vector<std::string> recordings;
  std::size_t images = std::numeric_limits<std::size_t>::max();
  int rounds = 3;
  bool count = false;
};

/// Of one image: in every form between marks, for filter_forms.py.
void count(const std::vector<Operation<double>>& operations, Contestants& forms, bool counts) {
  for (std::size_t i = 0; i < forms.size(); ++i) forms[i]->count(operations, static_cast<std::uint8_t>(i), counts);
  if (counts) end(static_cast<std::uint8_t>(Region::kImage));
}

/// Images that were compared.
std::size_t fly(replay::Source& source, const Options& options, Contestants& forms) {
  static std::optional<FlightTracker<FlightConfig>> tracker;
  static std::optional<NavSystem<FlightConfig>> system;
  const replay::Session& session = source.session();
  tracker.emplace(session.calibration.camera, session.parameters.tracker);
  system.emplace(session.calibration, session.parameters, *tracker, nullptr);
  OperationRecorder& recorder = OperationRecorder::instance();
  recorder.watch(system->estimator().filter());
  Reference reference;
  std::size_t done = 0;
  std::size_t compared = 0;
  replay::Tick tick;
  while (done < options.images && source.next(tick)) {
    if (!system->step(tick.input, tick.input.has_camera ? &tick.image : nullptr).image.processed) continue;
    ++done;
    const std::vector<Operation<double>> operations = recorder.take();
    if (operations.empty()) continue;
    // The image that the filter starts with costs what no other does.
    const bool counts = any_of(operations, Kind::kUpdate) && !any_of(operations, Kind::kRestart);
    compared += counts ? 1 : 0;
    if (options.count) {
      count(operations, forms, counts);
      continue;
    }
    const ReferenceImage expected = reference.repeat(operations);
    for (const auto& form : forms) form->repeat(operations, expected, options.rounds, counts);
    check_complete(forms.front()->covariance(), system->estimator().filter().covariance());
  }
  return compared;
}

double mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double largest(const std::vector<double>& values) { return *std::max_element(values.begin(), values.end()); }

void print(const Contestants& forms) {
  std::printf(
      "| form | time [ms] | of flown | correction error [sigma], median, worst | sigma error, median, worst | smallest "
      "eigenvalue | not definite | failed updates |\n|---|---:|---:|---|---|---:|---:|---:|\n");
  const double flown_ms = mean(forms.front()->record().time_ms);
  for (const auto& form : forms) {
    const Record& r = form->record();
    std::printf("| %s | %.3f | %.2f | %.1e, %.1e | %.1e, %.1e | %.1e | %zu | %zu |\n", form->name().c_str(),
                mean(r.time_ms), mean(r.time_ms) / flown_ms, median(r.correction_error), largest(r.correction_error),
                median(r.sigma_error), largest(r.sigma_error),
                *std::min_element(r.smallest_eigenvalue.begin(), r.smallest_eigenvalue.end()), r.indefinite,
                r.failed_updates);
  }
}

void compare(const std::string& recording, const Options& options) {
  const auto source = replay::open_asl({.folder = recording, .parameters = {}});
  Contestants forms = contestants();
  const std::size_t images = fly(*source, options, forms);
  if (images == 0) throw InputError(recording + ": the filter did not run; expected images that it was updated with");
  if (options.count) {
    for (const auto& form : forms) std::printf("%s\n", form->name().c_str());
    return;
  }
  std::printf("%s, %zu images with a running filter\n\n", recording.c_str(), images);
  print(forms);
  std::printf("\n");
}

}  // namespace
}  // namespace plumb::budget

int main(int argc, char** argv) {
  plumb::budget::Options options;
  CLI::App app{plumb::budget::kAbout, "plumb-filter-forms"};
  app.add_option("recordings", options.recordings, "folders in the ASL layout")->required();
  app.add_option("--images", options.images, "stop after so many of each recording");
  app.add_option("--rounds", options.rounds, "of each image, for the time")->check(plumb::number_from(1, 1e6));
  app.add_flag("--count", options.count, "only mark what each form does, for instructions to be counted");
  CLI11_PARSE(app, argc, argv);
  try {
    for (const std::string& recording : options.recordings) plumb::budget::compare(recording, options);
  } catch (const plumb::InputError& error) {
    std::fprintf(stderr, "plumb-filter-forms: %s\n", error.what());
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "plumb-filter-forms: %s\n", error.what());
    return 1;
  }
  return 0;
}
