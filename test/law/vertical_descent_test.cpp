// Straight down at constant speed, as before a landing, over another stepped ground in every flight. Nothing moves
// across the laser's spot, so that no parallax proves a range, and a plane through features says little of the one spot
// that all ranges hit. Scale must come from what ranges of that spot differ by, and the covariance must know how well.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "test/support/campaign/campaign.h"

namespace plumb::sim {
namespace {

constexpr int kRuns = 20;

TEST(VerticalDescent, RangesOfOneSpotTellTheScaleAndHowWellItIsKnown) {
  constexpr double kMaxScaleError_percent = 2.0;  // of a speed that is known to a seventh at the start
  CampaignSettings settings;
  settings.runs = kRuns;
  settings.jobs = 2;
  const std::vector<plumb::sim::Run> runs = fly_campaign(make_scene("vertical_descent"), settings);
  for (const plumb::sim::Run& run : runs) {
    EXPECT_FALSE(run.accuracy.diverged) << "seed " << run.seed;
    EXPECT_LT(std::abs(run.accuracy.cruise_scale_percent), kMaxScaleError_percent) << "seed " << run.seed;
  }
  const double looked_at = kNeesOfVectors.size() * kCheckpoints.size();
  const Interval bounds = nees_bounds(std::pow(0.95, 1.0 / looked_at), 3, kRuns);
  for (const NeesPart& part : kNeesOfVectors) {
    for (std::size_t i = 0; i < kCheckpoints.size(); ++i) {
      const SignedMean mean = mean_of(runs, [&](const Accuracy& a) { return a.nees[i].*part.member; });
      std::printf("  NEES %s at %.0f %%: %.2f, at most %.2f\n", part.name, 100.0 * kCheckpoints[i], mean.value,
                  bounds.high);
      EXPECT_LT(mean.value, bounds.high) << part.name;
    }
  }
}

}  // namespace
}  // namespace plumb::sim
