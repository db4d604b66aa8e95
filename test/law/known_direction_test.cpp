// With a sun sensor or a magnetometer the heading becomes absolute and stays so: the error that a camera, an IMU and a
// range leave to grow is bounded, the covariance says by what, and a disturbed field does no harm.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "test/support/campaign/campaign.h"
#include "test/support/estimator_feed.h"

namespace plumb::sim {
namespace {

constexpr int kRuns = 10;
constexpr DirectionNoise kSun{.rate_hz = 10.0, .noise_rad = 0.005};
constexpr DirectionNoise kMagnetometer{.rate_hz = 50.0, .noise_rad = 0.02};

std::vector<sim::Run> fly(const DirectionNoise& sun, const DirectionNoise& magnetometer) {
  CampaignSettings settings;
  settings.runs = kRuns;
  settings.jobs = 2;
  settings.flight.tracker.target_tracks = 80;
  settings.flight.sun = sun;
  settings.flight.magnetometer = magnetometer;
  return fly_campaign(make_scene("circuit"), settings);
}

double heading(const Accuracy& a) { return a.yaw_final_deg; }

void expect_consistent(const char* name, const std::vector<sim::Run>& runs) {
  const Interval bounds = nees_bounds(0.95, 3, kRuns);
  const double attitude = mean_of(runs, [](const Accuracy& a) { return a.nees.back().attitude; }).value;
  const double position = mean_of(runs, [](const Accuracy& a) { return a.nees.back().position; }).value;
  std::printf(
      "%s: heading error at the end mean %.3f, worst %.3f deg; NEES at the end: attitude %.2f, position %.2f "
      "(%.2f to %.2f)\n",
      name, spread_of(runs, heading).mean, spread_of(runs, heading).worst, attitude, position, bounds.low, bounds.high);
  EXPECT_EQ(diverged_count(runs), 0);
  EXPECT_LT(attitude, bounds.high);
  EXPECT_LT(position, bounds.high);
}

TEST(KnownDirection, ASunSensorHoldsTheHeading) {
  const std::vector<sim::Run> runs = fly(kSun, {});
  expect_consistent("sun", runs);
  EXPECT_LT(spread_of(runs, heading).worst, 0.2);  // of true east; one direction alone is good to 0.37
}

TEST(KnownDirection, AMagnetometerHoldsTheHeading) {
  const std::vector<sim::Run> runs = fly({}, kMagnetometer);
  expect_consistent("magnetometer", runs);
  EXPECT_LT(spread_of(runs, heading).worst, 0.5);  // one direction alone is good to 2.7
}

// For five seconds the field is turned by 20 degrees, as beside iron.
TEST(KnownDirection, ADisturbedFieldDoesNoHarm) {
  FlightSettings settings;
  settings.tracker.target_tracks = 80;
  settings.magnetometer = kMagnetometer;
  test::EstimatorFeed<Estimator<FlightConfig>> feed(make_scene("cruise_from_start"), settings);
  feed.on_direction = [](DirectionSample& sample) {
    const double t_s = (sample.t - flight_epoch()).seconds();
    const Vec3 turned = so3_exp(Vec3(0.0, 0.0, t_s > 8.0 && t_s < 13.0 ? 0.35 : 0.0)) * Vec3(sample.seen_I.data());
    std::copy_n(turned.data(), 3, sample.seen_I.begin());
    return true;
  };
  const auto heading_error_rad = [&] {
    const auto& q = feed.estimator->state().q_WI;
    const Quat right = east_of_world() * feed.truth().q_WI;
    return so3_log(right.conjugate() * Quat(q[0], q[1], q[2], q[3])).z();
  };
  feed.fly_until(8.0);
  const double before_rad = heading_error_rad();
  const std::uint64_t gated = feed.estimator->counters().directions_gated;
  feed.fly_until(13.0);
  EXPECT_GT(feed.estimator->counters().directions_gated, gated + 140);
  EXPECT_NEAR(heading_error_rad(), before_rad, 0.003);
  feed.fly_until(20.0);
  EXPECT_TRUE(feed.estimator->state().heading_known);
  EXPECT_LT(std::abs(heading_error_rad()), 0.02);
}

// The same flight in a world that is turned: nothing but the heading differs, from the first image on.
TEST(KnownDirection, TheWorldTurnsAndTheFlightIsTheSame) {
  FlightSettings settings;
  settings.tracker.target_tracks = 60;
  test::EstimatorFeed<Estimator<FlightConfig>> plain(make_scene("cruise_from_start"), settings);
  settings.sun = {.rate_hz = 30.0, .noise_rad = 1e-4};
  test::EstimatorFeed<Estimator<FlightConfig>> known(make_scene("cruise_from_start"), settings);
  plain.fly_until(10.0);
  known.fly_until(10.0);
  ASSERT_TRUE(known.estimator->state().heading_known);
  ASSERT_FALSE(plain.estimator->state().heading_known);
  const auto speed = [](const NavState& s) { return Vec3(s.v_WI_m_s.data()); };
  const Vec3 expected = east_of_world() * known.truth().v_WI_m_s;
  EXPECT_LT((speed(known.estimator->state()) - expected).norm(), 0.02);
  EXPECT_NEAR(speed(known.estimator->state()).norm(), speed(plain.estimator->state()).norm(), 0.02);
}

}  // namespace
}  // namespace plumb::sim
