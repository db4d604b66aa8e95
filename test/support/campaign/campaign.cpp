#include "test/support/campaign/campaign.h"

#include <time.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <mutex>
#include <thread>

#include "fsw/base/mission_config.h"
#include "hal/linux/monotonic_clock.h"
#include "test/support/sim/flight.h"
#include "test/support/sim/miscalibration.h"

namespace plumb::sim {
namespace {

double thread_cpu_s() { return clock_now(CLOCK_THREAD_CPUTIME_ID).seconds(); }

Run fly_seed(const Scene& scene, CampaignSettings settings, std::uint64_t seed) {
  settings.flight.seed = seed;
  const double start_s = thread_cpu_s();
  const FlightLog log = fly_once(scene, settings);
  Run run;
  run.seed = seed;
  run.cpu_s = thread_cpu_s() - start_s;
  run.accuracy = evaluate(log);
  if (!log.points.empty()) run.final_hash = log.points.back().state_hash;
  return run;
}

}  // namespace

FlightLog fly_once(const Scene& named, const CampaignSettings& settings) {
  Scene scene = named;
  if (scene.world_of != nullptr) scene.world = scene.world_of(settings.flight.seed);
  FlightSettings flight = settings.flight;
  EstimatorOptions options = matched_options(flight);
  if (settings.tuning == Tuning::kShipped) options = EstimatorOptions{};
  options.imu.gravity_m_s2 = scene.gravity_m_s2;
  options.range.enabled = settings.use_range;
  SensorCalibration file = scene.rig.calibration();
  if (settings.uncalibrated) {
    const CalibrationError error = draw_calibration_error(uncalibrated_sensors(), flight.seed);
    apply(error, flight);
    file = calibration_file(scene.rig, error);
    options.calibration = uncalibrated_sensors();
  }
  if (settings.adjust) settings.adjust(options);
  switch (settings.mission) {
    case Mission::kPaper: return fly<PaperConfig>(scene, flight, options, file);
    case Mission::kFlight: return fly<FlightConfig>(scene, flight, options, file);
    case Mission::kCalibrating: return fly<SelfCalibratingConfig>(scene, flight, options, file);
  }
  return {};
}

std::vector<Run> fly_campaign(const Scene& scene, const CampaignSettings& settings,
                              const std::function<void(int)>& progress) {
  std::vector<Run> runs(static_cast<std::size_t>(settings.runs));
  std::atomic<int> next = 0;
  int done = 0;
  std::mutex reporting;
  const auto work = [&] {
    for (int i = next++; i < settings.runs; i = next++) {
      runs[i] = fly_seed(scene, settings, settings.first_seed + static_cast<std::uint64_t>(i));
      const std::lock_guard<std::mutex> lock(reporting);
      ++done;
      if (progress) progress(done);
    }
  };
  std::vector<std::jthread> threads;
  for (int k = 1; k < settings.jobs; ++k) threads.emplace_back(work);
  work();
  threads.clear();  // joins
  return runs;
}

Spread spread_of(const std::vector<Run>& runs, const std::function<double(const Accuracy&)>& metric) {
  Spread spread;
  int count = 0;
  for (const Run& run : runs) {
    const double value = std::abs(metric(run.accuracy));
    if (!run.accuracy.started || std::isnan(value)) continue;
    spread.mean += value;
    spread.worst = std::max(spread.worst, value);
    ++count;
  }
  if (count == 0) return {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::quiet_NaN()};
  spread.mean /= count;
  return spread;
}

SignedMean mean_of(const std::vector<Run>& runs, const std::function<double(const Accuracy&)>& metric) {
  SignedMean mean;
  for (const Run& run : runs) {
    const double value = metric(run.accuracy);
    if (!run.accuracy.started || std::isnan(value)) continue;
    mean.value += value;
    ++mean.runs;
  }
  mean.value = mean.runs > 0 ? mean.value / mean.runs : std::numeric_limits<double>::quiet_NaN();
  return mean;
}

int diverged_count(const std::vector<Run>& runs) {
  return static_cast<int>(
      std::count_if(runs.begin(), runs.end(), [](const Run& run) { return run.accuracy.diverged; }));
}

}  // namespace plumb::sim
