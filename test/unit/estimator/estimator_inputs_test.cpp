// Bad inputs are refused and counted, and that is all: the flight goes on bit for bit as if they had never come.

#include <gtest/gtest.h>

#include <limits>

#include "fsw/base/mission_config.h"
#include "fsw/modes/mode_machine.h"
#include "test/support/estimator_feed.h"
#include "test/support/property.h"

namespace plumb {
namespace {

using Feed = test::EstimatorFeed<Estimator<PaperConfig>>;

constexpr double kLength_s = 3.0;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

Feed make_feed() { return Feed(test::lively_scene(kLength_s), test::quick_settings(true)); }

const Estimator<PaperConfig>& clean_flight() {
  static const Feed flown = [] {
    Feed feed = make_feed();
    feed.fly_until(kLength_s);
    EXPECT_TRUE(feed.estimator->state().valid);
    return feed;
  }();
  return *flown.estimator;
}

void expect_clean_flight(Feed& feed) {
  feed.fly_until(kLength_s);
  EXPECT_EQ(feed.estimator->state_hash(), clean_flight().state_hash());
  EXPECT_EQ(feed.estimator->counters().resets, 0U);
}

TEST(EstimatorInputs, TheSameInputsGiveTheSameBits) {
  Feed feed = make_feed();
  expect_clean_flight(feed);
}

TEST(EstimatorInputs, ImuThatIsNotFiniteOrBeyondItsLimitsIsRefused) {
  Feed feed = make_feed();
  test::Generator g(test::base_seed());
  std::uint64_t bad = 0;
  feed.on_imu = [&](ImuSample& sample) {
    ImuSample spoilt = sample;
    spoilt.t = sample.t - Duration::from_us(100);
    const double poison[] = {kNaN, kInfinity, -kInfinity, 1e4, -1e4};
    auto& field = g.integer(0, 1) == 0 ? spoilt.gyro_rad_s : spoilt.accel_m_s2;
    field[static_cast<std::size_t>(g.integer(0, 2))] = poison[g.integer(0, 4)];
    EXPECT_EQ(feed.estimator->add_imu(spoilt), Status::kInvalidValue);
    ++bad;
    return true;
  };
  expect_clean_flight(feed);
  EXPECT_EQ(feed.estimator->counters().imu_invalid, bad);
  EXPECT_EQ(feed.estimator->counters().imu_samples, 2 * bad);
}

TEST(EstimatorInputs, ImuOutOfOrderIsRefused) {
  Feed feed = make_feed();
  ImuSample last;
  std::uint64_t repeated = 0;
  feed.on_imu = [&](ImuSample& sample) {
    if (last.t != Time::never()) {
      EXPECT_EQ(feed.estimator->add_imu(last), Status::kOutOfOrder);
      last.t = last.t - Duration::from_ms(7);
      EXPECT_EQ(feed.estimator->add_imu(last), Status::kOutOfOrder);
      repeated += 2;
    }
    last = sample;
    return true;
  };
  expect_clean_flight(feed);
  EXPECT_EQ(feed.estimator->counters().imu_out_of_order, repeated);
}

TEST(EstimatorInputs, RangesThatAreNoneAreRefused) {
  Feed feed = make_feed();
  test::Generator g(test::base_seed());
  std::uint64_t bad = 0;
  feed.on_range = [&](RangeSample& sample) {
    RangeSample spoilt = sample;
    switch (g.integer(0, 6)) {
      case 0: spoilt.range_m = kNaN; break;
      case 1: spoilt.range_m = kInfinity; break;
      case 2: spoilt.range_m = -1.0; break;
      case 3: spoilt.range_m = 0.01; break;   // nearer than the device measures
      case 4: spoilt.range_m = 100.0; break;  // farther
      case 5: spoilt.quality = RangeQuality::kNoReturn; break;
      default: spoilt.quality = RangeQuality::kWeak; break;
    }
    spoilt.t = sample.t - Duration::from_us(50);
    EXPECT_EQ(feed.estimator->add_range(spoilt), Status::kInvalidValue);
    ++bad;
    return true;
  };
  expect_clean_flight(feed);
  EXPECT_EQ(feed.estimator->counters().ranges_invalid, bad);
}

TEST(EstimatorInputs, ARangeComesInOnceOrNotAtAll) {
  Feed feed = make_feed();
  std::uint64_t repeated = 0;
  feed.on_range = [&](RangeSample& sample) {
    EXPECT_EQ(feed.estimator->add_range(sample), Status::kOk);
    EXPECT_EQ(feed.estimator->add_range(sample), Status::kStale);
    RangeSample older = sample;
    older.t = sample.t - Duration::from_ms(1);
    EXPECT_EQ(feed.estimator->add_range(older), Status::kStale);
    repeated += 2;
    return false;  // handed over here
  };
  expect_clean_flight(feed);
  EXPECT_EQ(feed.estimator->counters().ranges_stale, clean_flight().counters().ranges_stale + repeated);
}

TEST(EstimatorInputs, FramesOutOfOrderAreRefused) {
  Feed feed = make_feed();
  Feed::Frame last;
  std::uint64_t repeated = 0;
  feed.on_frame = [&](Feed::Frame& frame) {
    if (last.t != Time::never()) {
      EXPECT_EQ(feed.estimator->process(last), Status::kOutOfOrder);
      ++repeated;
    }
    last = frame;
    return true;
  };
  expect_clean_flight(feed);
  EXPECT_EQ(feed.estimator->counters().frames_out_of_order, repeated);
}

TEST(EstimatorInputs, AFrameTheImuDoesNotReachIsRefused) {
  Feed feed = make_feed();
  std::uint64_t early = 0;
  feed.on_frame = [&](Feed::Frame& frame) {
    Feed::Frame ahead = frame;
    ahead.t = frame.t + Duration::from_seconds(1.0);
    EXPECT_FALSE(feed.estimator->imu_reaches(ahead.t));
    EXPECT_EQ(feed.estimator->process(ahead), Status::kStale);
    ++early;
    return true;
  };
  expect_clean_flight(feed);
  EXPECT_EQ(feed.estimator->counters().frames_without_imu, early);
}

/// All ranges ever offered are in exactly one place.
void expect_every_range_accounted_for(const Feed& feed, std::uint64_t waiting_at_most) {
  const EstimatorCounters& c = feed.estimator->counters();
  const std::uint64_t known = test::filed_ranges(c);
  EXPECT_EQ(c.ranges, feed.ranges_offered());
  EXPECT_LE(known, c.ranges);
  EXPECT_LE(c.ranges - known, waiting_at_most);
}

TEST(EstimatorInputs, EveryRangeIsCountedOnce) {
  sim::FlightSettings settings = test::quick_settings(true);
  settings.range.dropout = 0.2;
  settings.range.outlier = 0.2;
  for (const bool by_facet : {true, false}) {
    Feed feed(test::lively_scene(kLength_s), settings);
    if (by_facet) feed.estimator = test::facet_only(settings);  // which gates at once
    feed.fly_until(kLength_s);
    const EstimatorCounters& counters = feed.estimator->counters();
    EXPECT_GT(by_facet ? counters.ranges_used : counters.ranges_feature, 20U);
    if (by_facet) {
      EXPECT_GT(counters.ranges_gated, 2U);
    }
    EXPECT_GT(counters.ranges_invalid, 5U);
    expect_every_range_accounted_for(feed, 2);
  }
}

TEST(EstimatorInputs, RangesBeforeTheStartAndThroughAResetAreCountedToo) {
  Feed feed(test::lively_scene(8.0), test::quick_settings(false));
  feed.fly_until(4.0);
  EXPECT_TRUE(feed.estimator->state().valid);
  feed.estimator->reset();
  feed.fly_until(8.0);
  EXPECT_TRUE(feed.estimator->state().valid);
  expect_every_range_accounted_for(feed, 2);
}

TEST(EstimatorInputs, RangesThroughACameraOutageAreCountedToo) {
  Feed feed = Feed(test::lively_scene(8.0), test::quick_settings(true));
  feed.on_frame = [](Feed::Frame& frame) {
    const double t_s = (frame.t - sim::flight_epoch()).seconds();
    return t_s < 2.0 || t_s > 6.0;  // a hundred ranges come meanwhile, more than are kept
  };
  feed.fly_until(8.0);
  expect_every_range_accounted_for(feed, 2);
}

// After an outage of images, the ranges of its beginning are too old to say anything of the newest one.
TEST(EstimatorInputs, RangesOlderThanTheirAgeAreNotUsed) {
  const sim::FlightSettings settings = test::quick_settings(true);
  Feed feed(test::lively_scene(kLength_s), settings);
  feed.estimator = test::facet_only(settings);
  constexpr double kFrom_s = 1.0;
  constexpr double kTo_s = 1.5;
  feed.fly_until(kFrom_s);
  const std::uint64_t stale_before = feed.estimator->counters().ranges_stale;
  std::uint64_t old = 0;
  feed.on_image = [](Time t) { return (t - sim::flight_epoch()).seconds() > kTo_s; };
  feed.on_range = [&](RangeSample& range) {
    const double t_s = (range.t - sim::flight_epoch()).seconds();
    if (t_s < kTo_s - RangeOptions{}.max_age_s) ++old;
    return true;
  };
  feed.fly_until(kTo_s + 0.1);
  EXPECT_GE(old, 5U);
  EXPECT_GE(feed.estimator->counters().ranges_stale - stale_before, old);
}

// One echo from something in between must not tell how far away the scene is.
TEST(EstimatorInputs, NewFeaturesDoNotTakeTheDepthOfOneFalseEcho) {
  const auto fly = [](bool false_echo) {
    const sim::Trajectory hover(Vec3(0.0, 0.0, 5.0), kLength_s);  // no parallax, so that depths are guessed
    Feed feed({"hover", hover, sim::flat_ground(), sim::nadir_rig()}, test::quick_settings(true));
    feed.on_range = [false_echo](RangeSample& range) {
      const double t_s = (range.t - sim::flight_epoch()).seconds();
      if (false_echo && t_s > 0.1 && std::fmod(t_s, 0.2) < 0.04) range.range_m = 0.5;
      return true;
    };
    double greatest = 0.0;
    feed.after_frame = [&](Status) {
      for (const SlamFeature& feature : feed.estimator->slam_features()) {
        greatest = std::max(greatest, feature.parameters.z());
      }
    };
    feed.fly_until(2.0);
    return greatest;
  };
  EXPECT_NEAR(fly(true), fly(false), 0.05);
}

// A range is compared with the ground as it is at its own time, not at the image's.
TEST(EstimatorInputs, ARangeIsUsedAtItsOwnTime) {
  sim::Trajectory descent(Vec3(0.0, 0.0, 25.0), 3.0);
  descent.change_speed(-2.0, 1.0, {0.5, 0.0, -5.0});
  const sim::Scene scene{"fast descent", descent, sim::flat_ground(), sim::nadir_rig()};
  sim::FlightSettings settings = test::quick_settings(true);
  settings.imu = sim::noise_free();
  settings.image_rate_hz = 12.0;
  settings.range.noise_m = 0.0;
  settings.tracker.pixel_noise_px = 0.0;  // a facet counts as flat once its features are known
  Feed feed(scene, settings);
  feed.estimator = test::facet_only(settings);
  RangeSample newest;
  feed.on_range = [&newest](RangeSample& sample) {
    newest = sample;
    return true;
  };
  int compared = 0;
  feed.after_frame = [&](Status) {
    const FrameReport& report = feed.estimator->report();
    if (report.range_outcome != RangeOutcome::kUsed || report.range_measured_m != newest.range_m) return;
    const Time now = feed.estimator->state().t;
    if (now < sim::flight_epoch() + Duration::from_seconds(1.5)) return;  // the features' depths are not known yet
    if ((now - newest.t).seconds() < 0.025) return;                       // by now an eighth of a metre lower
    EXPECT_NEAR(report.range_predicted_m, report.range_measured_m, 0.06);
    ++compared;
  };
  feed.fly_until(3.0);
  EXPECT_GT(compared, 3);
}

// The range finder falls silent: no value is used again (F2).
TEST(EstimatorInputs, ASilentRangeFinderIsNotHeardAgain) {
  Feed feed = make_feed();
  feed.fly_until(1.2);
  EXPECT_EQ(mode_at_image(feed.estimator->state(), {}), NavMode::kRangeVio);
  const std::uint64_t used = feed.estimator->counters().ranges_used;
  feed.on_range = [](RangeSample&) { return false; };
  std::uint32_t later = 0;
  feed.after_frame = [&](Status) {
    later += feed.estimator->report().ranges_used;
    const double t_s = (feed.estimator->state().t - sim::flight_epoch()).seconds();
    if (t_s > 1.7) later += feed.estimator->report().ranged_used;  // until then tracks have theirs from before
  };
  feed.fly_until(kLength_s);
  EXPECT_EQ(mode_at_image(feed.estimator->state(), {}), NavMode::kVio);
  EXPECT_LE(later, 1U);  // the one that was waiting
  EXPECT_LE(feed.estimator->counters().ranges_used, used + 1);
}

// A feature seen for the first time changes nothing yet, but it will: the hash must not wait until then to tell two
// runs apart.
TEST(EstimatorInputs, TheHashSeesWhatHasNoEffectYet) {
  const auto fly = [](bool one_more) {
    Feed feed(test::lively_scene(2.0), test::quick_settings(true));
    feed.fly_until(1.9);
    feed.on_frame = [one_more](Feed::Frame& frame) {
      if (one_more) {
        EXPECT_EQ(frame.observations.push_back({4'000'000'000U, 0.0F, 0.0F, 0.4, 0.3}), Status::kOk);
      }
      return true;
    };
    const std::uint64_t before = feed.estimator->counters().frames;
    for (double t_s = 1.9; feed.estimator->counters().frames == before; t_s += 1e-3) feed.fly_until(t_s);
    return std::pair(feed.estimator->state(), feed.estimator->state_hash());
  };
  const auto [state, hash] = fly(false);
  const auto [same_state, other_hash] = fly(true);
  EXPECT_EQ(state.covariance, same_state.covariance);
  EXPECT_EQ(state.p_WI_m, same_state.p_WI_m);
  EXPECT_NE(hash, other_hash);
  EXPECT_EQ(fly(true).second, other_hash);
}

}  // namespace
}  // namespace plumb
