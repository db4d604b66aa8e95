#pragma once
// Many flights of one scene that differ in the seed of the noise only, and their statistics.

#include <cstdint>
#include <functional>
#include <vector>

#include "test/support/sim/accuracy.h"
#include "test/support/sim/scene.h"

namespace plumb::sim {

enum class Mission { kPaper, kFlight, kCalibrating };  ///< which compile-time configuration flies
enum class Tuning { kMatched, kShipped };  ///< the filter knows the simulation's noise, or flies with its defaults

struct CampaignSettings {
  FlightSettings flight;  ///< its seed is replaced by each run's
  Mission mission = Mission::kFlight;
  Tuning tuning = Tuning::kMatched;
  bool uncalibrated = false;  ///< the sensors are off by a draw of uncalibrated_sensors(); kCalibrating estimates it
  bool use_range = true;
  std::function<void(EstimatorOptions&)> adjust;  ///< applied last, if any; called from several threads
  int runs = 20;
  std::uint64_t first_seed = 1;
  int jobs = 1;  ///< threads; the results do not depend on it
};

struct Run {
  std::uint64_t seed = 0;
  Accuracy accuracy;
  double cpu_s = 0.0;            ///< of the thread, simulation included
  std::uint64_t final_hash = 0;  ///< of the estimator's state at the end
};

/// One flight; the seed is settings.flight.seed.
FlightLog fly_once(const Scene& scene, const CampaignSettings& settings);
/// All flights, in order of seed. `progress` is called, one call at a time, after each of them with the number done.
std::vector<Run> fly_campaign(const Scene& scene, const CampaignSettings& settings,
                              const std::function<void(int)>& progress = {});

/// Mean and largest absolute value of a metric over the runs that have it (started, and not not-a-number).
struct Spread {
  double mean = 0.0;
  double worst = 0.0;
};
Spread spread_of(const std::vector<Run>& runs, const std::function<double(const Accuracy&)>& metric);
/// Mean with sign, and how many runs it is taken over.
struct SignedMean {
  double value = 0.0;
  int runs = 0;
};
SignedMean mean_of(const std::vector<Run>& runs, const std::function<double(const Accuracy&)>& metric);
int diverged_count(const std::vector<Run>& runs);

}  // namespace plumb::sim
