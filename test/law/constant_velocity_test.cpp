// The flight the paper is about: standstill, climb, then a minute straight ahead at constant speed, where a camera and
// an IMU alone lose the scale. From standstill without any help from the truth, over flat and over stepped ground, the
// range must hold the scale, and the covariance must say how wrong the estimate is.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <string>

#include "test/support/campaign/campaign.h"

namespace plumb::sim {
namespace {

constexpr int kRuns = 20;
constexpr std::uint64_t kFirstSeed = 1;
constexpr double kMaxScaleError_percent = 0.5;
constexpr double kConfidence = 0.95;

/// Camera rate and number of tracks as in flight.
CampaignSettings law_settings() {
  CampaignSettings settings;
  settings.runs = kRuns;
  settings.first_seed = kFirstSeed;
  settings.jobs = 2;
  return settings;
}

double cruise_scale(const Accuracy& accuracy) { return accuracy.cruise_scale_percent; }
double position_rmse(const Accuracy& accuracy) { return accuracy.position_rmse_m; }

void print_row(const char* filter, const std::vector<Run>& runs) {
  const Spread scale = spread_of(runs, cruise_scale);
  const Spread position = spread_of(runs, position_rmse);
  std::printf("  %-10s scale error mean %.3f %%, worst %.3f %%; position RMSE mean %.3f m, worst %.3f m (%d runs)\n",
              filter, scale.mean, scale.worst, position.mean, position.worst, static_cast<int>(runs.size()));
}

/// What the filter is told is as far off what it expects as it expects. Thousands of rows in every flight; those of one
/// track that stays in the state are correlated, so that the bounds are wider than chi-square's.
void expect_innovations(const std::vector<Run>& runs) {
  const double feature = mean_of(runs, [](const Accuracy& a) { return a.feature_nis; }).value;
  const double track = mean_of(runs, [](const Accuracy& a) { return a.track_nis; }).value;
  const double ranged = mean_of(runs, [](const Accuracy& a) { return a.ranged_nis; }).value;
  std::printf("  NIS of features in the state %.3f (2), of tracks per row %.3f (1), of their ranges %.3f (1)\n",
              feature, track, ranged);
  EXPECT_NEAR(feature, 2.0, 0.04);
  EXPECT_NEAR(track, 1.0, 0.02);
  EXPECT_NEAR(ranged, 1.0, 0.1);
}

/// Flies one scene with and without range, prints both, and checks what must hold over any ground.
std::vector<Run> fly_and_check_scale(const char* scene_name) {
  const Scene scene = make_scene(scene_name);
  CampaignSettings settings = law_settings();
  const std::vector<Run> range_vio = fly_campaign(scene, settings);
  settings.use_range = false;
  const std::vector<Run> vio = fly_campaign(scene, settings);
  std::printf("%s, seeds %d to %d:\n", scene_name, static_cast<int>(kFirstSeed),
              static_cast<int>(kFirstSeed) + kRuns - 1);
  print_row("range-VIO", range_vio);
  print_row("VIO", vio);
  for (const Run& run : range_vio) {
    SCOPED_TRACE("seed " + std::to_string(run.seed));
    EXPECT_FALSE(run.accuracy.diverged);
    EXPECT_LT(std::abs(run.accuracy.cruise_scale_percent), kMaxScaleError_percent);
  }
  expect_innovations(range_vio);
  return range_vio;
}

/// Errors are correlated in time but not from run to run, so the mean over the runs at a fixed instant is chi-square
/// with 3 degrees of freedom per run. Twelve such means are looked at: all of them are within these bounds with the
/// confidence asked for. Their mean over the instants, which shows a covariance that is wrong throughout much sooner,
/// scatters no more than that of one instant.
void expect_consistent(const std::vector<Run>& runs) {
  constexpr double kInstants = kCheckpoints.size();
  const Interval at_any = nees_bounds(std::pow(kConfidence, 1.0 / (kInstants * kNeesOfVectors.size())), 3, kRuns);
  const Interval throughout = nees_bounds(kConfidence, 3, kRuns);
  for (const NeesPart& part : kNeesOfVectors) {
    double sum = 0.0;
    for (std::size_t checkpoint = 0; checkpoint < kCheckpoints.size(); ++checkpoint) {
      const SignedMean mean = mean_of(runs, [&](const Accuracy& a) { return a.nees[checkpoint].*part.member; });
      std::printf("  NEES %s at %.0f %% of the flight: %.2f, expected %.2f to %.2f\n", part.name,
                  100.0 * kCheckpoints[checkpoint], mean.value, at_any.low, at_any.high);
      EXPECT_EQ(mean.runs, kRuns);
      EXPECT_TRUE(at_any.contains(mean.value)) << part.name << " at checkpoint " << checkpoint;
      sum += mean.value;
    }
    std::printf("  NEES %s, mean of these: %.2f, expected %.2f to %.2f\n", part.name, sum / kInstants, throughout.low,
                throughout.high);
    EXPECT_TRUE(throughout.contains(sum / kInstants)) << part.name;
  }
}

TEST(ConstantVelocity, RangeHoldsTheScaleOverFlatGround) { expect_consistent(fly_and_check_scale("outdoor_cruise")); }

TEST(ConstantVelocity, RangeHoldsTheScaleOverSteppedGround) {
  expect_consistent(fly_and_check_scale("outdoor_cruise_stepped"));
}

}  // namespace
}  // namespace plumb::sim
