// A filter that is told half or twice the noise of its features finds the right one in flight, and then its covariance
// says how wrong it is.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "test/support/sim/accuracy.h"
#include "test/support/sim/flight.h"

namespace plumb::sim {
namespace {

constexpr int kRuns = 20;             // of ten, one draw in a hundred looks like a covariance that is too small
constexpr double kConfidence = 0.95;  // of all means that are looked at
constexpr int kMeans = 4;
constexpr double kWithin = 0.15;

TEST(AdaptiveNoise, FindsTheNoiseOfTheTracksAndStaysConsistent) {
  const Scene scene = make_scene("excitation");
  for (const double factor : {0.5, 2.0}) {
    double position_nees = 0.0;
    double attitude_nees = 0.0;
    double mean_px = 0.0;
    FlightSettings settings;
    for (int k = 0; k < kRuns; ++k) {
      settings.seed = static_cast<std::uint64_t>(k + 1);
      EstimatorOptions options = matched_options(settings);
      options.vision.pixel_noise_px = factor * settings.tracker.pixel_noise_px;
      options.vision.pixel_noise_images = 60;
      const auto estimator = std::make_unique<Estimator<FlightConfig>>(options, scene.rig.calibration());
      const FlightLog log = Flight<Estimator<FlightConfig>>(scene, settings, *estimator).fly();
      const Accuracy accuracy = evaluate(log);
      EXPECT_NEAR(estimator->pixel_noise_px() / settings.tracker.pixel_noise_px, 1.0, kWithin) << "seed " << k + 1;
      mean_px += estimator->pixel_noise_px() / kRuns;
      position_nees += accuracy.nees.back().position / kRuns;
      attitude_nees += accuracy.nees.back().attitude / kRuns;
    }
    const Interval bounds = nees_bounds(std::pow(kConfidence, 1.0 / kMeans), 3, kRuns);
    std::printf("told %.2f px of %.2f px: found %.3f px; NEES position %.2f, attitude %.2f, expected %.2f to %.2f\n",
                factor * settings.tracker.pixel_noise_px, settings.tracker.pixel_noise_px, mean_px, position_nees,
                attitude_nees, bounds.low, bounds.high);
    EXPECT_TRUE(bounds.contains(position_nees));
    EXPECT_TRUE(bounds.contains(attitude_nees));
  }
}

}  // namespace
}  // namespace plumb::sim
