// A campaign is a function of its seeds: how it is shared out over threads must not show.

#include "test/support/campaign/campaign.h"

#include <gtest/gtest.h>

namespace plumb::sim {
namespace {

CampaignSettings short_flights() {
  CampaignSettings settings;
  settings.flight.image_rate_hz = 10.0;
  settings.flight.tracker.target_tracks = 40;
  settings.runs = 3;
  return settings;
}

TEST(Campaign, SameSeedSameBitsWhateverTheNumberOfThreads) {
  const Scene scene = make_scene("descent");
  CampaignSettings settings = short_flights();
  const auto alone = fly_campaign(scene, settings);
  settings.jobs = 3;
  int reports = 0;
  const auto shared = fly_campaign(scene, settings, [&](int done) { EXPECT_EQ(done, ++reports); });
  EXPECT_EQ(reports, settings.runs);
  ASSERT_EQ(alone.size(), shared.size());
  for (std::size_t i = 0; i < alone.size(); ++i) {
    EXPECT_EQ(alone[i].seed, settings.first_seed + i);
    EXPECT_EQ(alone[i].seed, shared[i].seed);
    EXPECT_NE(alone[i].final_hash, 0U);
    EXPECT_EQ(alone[i].final_hash, shared[i].final_hash);
    EXPECT_EQ(alone[i].accuracy.position_rmse_m, shared[i].accuracy.position_rmse_m);
  }
  EXPECT_NE(alone[0].final_hash, alone[1].final_hash);
}

TEST(Campaign, BothMissionsAndTuningsFly) {
  const Scene scene = make_scene("descent");
  for (const Mission mission : {Mission::kPaper, Mission::kFlight}) {
    for (const Tuning tuning : {Tuning::kMatched, Tuning::kShipped}) {
      CampaignSettings settings = short_flights();
      settings.mission = mission;
      settings.tuning = tuning;
      settings.flight.start_from_truth = true;
      const Accuracy accuracy = evaluate(fly_once(scene, settings));
      EXPECT_TRUE(accuracy.started);
      EXPECT_FALSE(accuracy.diverged);
    }
  }
}

TEST(Campaign, StatisticsLeaveOutWhatIsMissing) {
  std::vector<sim::Run> runs(3);
  runs[0].accuracy.started = runs[1].accuracy.started = true;
  runs[0].accuracy.cruise_scale_percent = -2.0;
  runs[1].accuracy.cruise_scale_percent = 1.0;
  runs[2].accuracy.diverged = true;  // never started: its zeros are no measurement
  const auto scale = [](const Accuracy& a) { return a.cruise_scale_percent; };
  EXPECT_EQ(spread_of(runs, scale).mean, 1.5);
  EXPECT_EQ(spread_of(runs, scale).worst, 2.0);
  EXPECT_EQ(mean_of(runs, scale).value, -0.5);
  EXPECT_EQ(mean_of(runs, scale).runs, 2);
  EXPECT_EQ(diverged_count(runs), 1);
}

}  // namespace
}  // namespace plumb::sim
