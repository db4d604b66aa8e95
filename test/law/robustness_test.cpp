// What the world does to the sensors in flight, one fault at a time: the filter survives it without a reset, says what
// it lost, and is back to range-VIO with an error that its covariance admits. Straight flight at 2 m/s over steps,
// started in motion: nothing excites the filter, so whatever a fault spoils can only be repaired by the range.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "fsw/base/mission_config.h"
#include "fsw/modes/mode_machine.h"
#include "test/support/estimator_feed.h"
#include "test/support/sim/accuracy.h"

namespace plumb {
namespace {

using Feed = test::EstimatorFeed<Estimator<FlightConfig>>;

constexpr double kFault_s = 8.0;  // from here
constexpr double kOver_s = 13.0;  // to here, where a fault ends
constexpr double kEnd_s = 25.0;

double flight_s(Time t) { return (t - sim::flight_epoch()).seconds(); }

bool at_fault(Time t) { return flight_s(t) > kFault_s && flight_s(t) < kOver_s; }

/// What the filter says of itself, from which a user sees that something is wrong.
struct Told {
  std::set<NavMode> modes;            ///< during the fault
  std::uint64_t images_unused = 0;    ///< during the fault: they came, and no feature of theirs was of use
  std::uint64_t tracks_rejected = 0;  ///< from the fault on
  std::uint64_t ranged_rejected = 0;  ///< of them those whose range is in the rows
  double nis_sum = 0.0;               ///< of the features, during the fault; 2 of each is right
  std::uint64_t nis_features = 0;
  double velocity_sigma_before_m_s = 0.0;  ///< along the flight
  double velocity_sigma_worst_m_s = 0.0;   ///< from the fault on

  void note(const NavState& state, const FrameReport& report) {
    constexpr std::size_t kVelocity = 3 * (kNavErrorSize + 1);
    const double sigma_m_s = std::sqrt(state.covariance[kVelocity]);
    if (flight_s(state.t) <= kFault_s) {
      velocity_sigma_before_m_s = sigma_m_s;
      return;
    }
    velocity_sigma_worst_m_s = std::max(velocity_sigma_worst_m_s, sigma_m_s);
    tracks_rejected += report.slam_rejected + report.msckf_rejected;
    ranged_rejected += report.ranged_rejected;
    if (!at_fault(state.t)) return;
    modes.insert(mode_at_image(state, {}));
    if (report.slam_used + report.msckf_used == 0) ++images_unused;
    nis_sum += report.slam_nis;
    nis_features += report.slam_used + report.slam_rejected;
  }
  double mean_nis() const { return nis_sum / static_cast<double>(nis_features); }
};

// Above what a flight without a fault tells (NothingWrong).
constexpr std::uint64_t kManyTracks = 250;
constexpr std::uint64_t kManyRanges = 10;
constexpr double kSuspiciousNis = 2.15;  // of several thousand features: 2 +- 0.02

class Robustness : public testing::Test {
 protected:
  Robustness() { settings.tracker.target_tracks = 80; }

  /// Flies with what the test has changed in `settings` and `spoil` does to the samples.
  template <typename Spoil>
  void fly(Spoil spoil) {
    const sim::Scene scene = sim::make_scene("cruise_from_start_stepped");
    Feed feed(scene, settings);
    spoil(feed);
    feed.after_frame = [&](Status) {
      const NavState& state = feed.estimator->state();
      valid_always = valid_always && (state.valid || !valid);
      valid = state.valid;
      ASSERT_TRUE(test::all_finite(state));
      told.note(state, feed.estimator->report());
    };
    feed.fly_until(kEnd_s);
    counters = feed.estimator->counters();
    end = feed.estimator->state();
    const Vec3 speed_error = Vec3(end.v_WI_m_s.data()).norm() * Vec3::UnitX() - feed.truth().v_WI_m_s;
    speed_error_m_s = speed_error.x();
  }

  /// Fifteen times the usual error at most, and four sigmas of what the filter says itself.
  void expect_recovered() const {
    constexpr double kMaxSpeedError_m_s = 0.06;
    EXPECT_TRUE(valid_always);
    EXPECT_EQ(counters.resets, 0U);
    EXPECT_EQ(mode_at_image(end, {}), NavMode::kRangeVio);
    EXPECT_LT(std::abs(speed_error_m_s), kMaxSpeedError_m_s);
    constexpr std::size_t kSpeed = 3 * (kNavErrorSize + 1);
    EXPECT_LT(std::abs(speed_error_m_s),
              4.0 * std::sqrt(end.covariance[kSpeed] + end.covariance[kSpeed + kNavErrorSize + 1]));
    RecordProperty("speed_error_mm_s", std::to_string(1e3 * speed_error_m_s));
  }

  sim::FlightSettings settings;
  Told told;
  bool valid = false;
  bool valid_always = true;
  EstimatorCounters counters;
  NavState end;
  double speed_error_m_s = 0.0;
};

TEST_F(Robustness, NothingWrong) {
  fly([](Feed&) {});
  expect_recovered();
  EXPECT_EQ(told.modes, std::set{NavMode::kRangeVio});
  EXPECT_EQ(told.images_unused, 0U);
  EXPECT_LT(told.tracks_rejected, kManyTracks);
  EXPECT_LT(told.ranged_rejected, kManyRanges);
  EXPECT_LT(told.mean_nis(), kSuspiciousNis);
  EXPECT_LT(told.velocity_sigma_worst_m_s, 1.1 * told.velocity_sigma_before_m_s);
}

// A fifth of the tracks sit on something that drives along, at half the speed of the vehicle.
TEST_F(Robustness, MovingObjects) {
  fly([](Feed& feed) {
    feed.on_frame = [](Feed::Frame& frame) {
      for (FeatureObservation& o : frame.observations) {
        if (at_fault(frame.t) && o.track_id % 5 == 0)
          o.x += 0.1 * ((frame.t - sim::flight_epoch()).seconds() - kFault_s);
      }
      return true;
    };
  });
  expect_recovered();
  EXPECT_GT(told.tracks_rejected, kManyTracks);
}

// Texture that repeats: a track jumps to a twin of its patch and stays there.
TEST_F(Robustness, RepeatedTexture) {
  settings.tracker.mismatch = 0.01;
  fly([](Feed&) {});
  expect_recovered();
  EXPECT_GT(told.tracks_rejected, kManyTracks);
}

TEST_F(Robustness, SingleWrongObservations) {
  settings.tracker.outlier = 0.05;
  fly([](Feed&) {});
  expect_recovered();
  EXPECT_GT(told.tracks_rejected, kManyTracks);
}

// The light changes at once: every track is lost and others begin, once a second.
TEST_F(Robustness, AbruptLight) {
  fly([](Feed& feed) {
    feed.on_frame = [](Feed::Frame& frame) {
      constexpr std::uint32_t kMoreThanThereAre = 100000;
      const auto second = static_cast<std::uint32_t>((frame.t - sim::flight_epoch()).seconds());
      const auto changes = std::clamp<std::uint32_t>(second, 8, 13) - 8;
      for (FeatureObservation& o : frame.observations) o.track_id += changes * kMoreThanThereAre;
      return true;
    };
  });
  expect_recovered();
  EXPECT_GE(told.images_unused, 5U);  // one for each change
}

TEST_F(Robustness, NoImages) {
  fly([](Feed& feed) { feed.on_image = [](Time t) { return !at_fault(t); }; });
  expect_recovered();
  EXPECT_GT(told.velocity_sigma_worst_m_s, 3.0 * told.velocity_sigma_before_m_s);
}

TEST_F(Robustness, ImagesWithoutFeatures) {
  fly([](Feed& feed) {
    feed.on_frame = [](Feed::Frame& frame) {
      if (at_fault(frame.t)) frame.observations.clear();
      return true;
    };
  });
  expect_recovered();
  EXPECT_GT(told.velocity_sigma_worst_m_s, 3.0 * told.velocity_sigma_before_m_s);
  EXPECT_TRUE(told.modes.contains(NavMode::kInertial));
}

TEST_F(Robustness, NoRanges) {
  fly([](Feed& feed) { feed.on_range = [](RangeSample& range) { return !at_fault(range.t); }; });
  expect_recovered();
  EXPECT_TRUE(told.modes.contains(NavMode::kVio));
}

TEST_F(Robustness, NeitherImagesNorRanges) {
  fly([](Feed& feed) {
    feed.on_image = [](Time t) { return !at_fault(t); };
    feed.on_range = [](RangeSample& range) { return !at_fault(range.t); };
  });
  expect_recovered();
  EXPECT_GT(told.velocity_sigma_worst_m_s, 3.0 * told.velocity_sigma_before_m_s);
}

// A bird, a branch, a lamp: every tenth range is seven metres short.
TEST_F(Robustness, SevenMetresShort) {
  fly([n = 0](Feed& feed) mutable {
    feed.on_range = [&n](RangeSample& range) {
      if (at_fault(range.t) && ++n % 10 == 0) range.range_m = std::max(range.range_m - 7.0, 0.5);
      return true;
    };
  });
  expect_recovered();
  EXPECT_GT(told.ranged_rejected, kManyRanges);
}

// A device that repeats its last value while the ground below goes up and down.
TEST_F(Robustness, RangeFinderStuck) {
  double last_m = 0.0;
  fly([&last_m](Feed& feed) {
    feed.on_range = [&last_m](RangeSample& range) {
      if (at_fault(range.t)) {
        range.range_m = last_m;
      } else {
        last_m = range.range_m;
      }
      return true;
    };
  });
  expect_recovered();
  EXPECT_GT(told.ranged_rejected, kManyRanges);
}

// Echoes on a detour: every fifth range is up to a third too long.
TEST_F(Robustness, MultiplePaths) {
  fly([n = 0](Feed& feed) mutable {
    feed.on_range = [&n](RangeSample& range) {
      if (at_fault(range.t) && ++n % 5 == 0) range.range_m *= 1.0 + 0.03 * static_cast<double>(n % 11);
      return true;
    };
  });
  expect_recovered();
  EXPECT_GT(told.ranged_rejected, kManyRanges);
}

// An accelerometer at the end of its scale for a moment, ten times.
TEST_F(Robustness, AccelerometerSaturates) {
  fly([](Feed& feed) {
    feed.on_imu = [](ImuSample& sample) {
      constexpr double kFullScale_m_s2 = 9.5;  // gravity is above it
      const double t_s = (sample.t - sim::flight_epoch()).seconds();
      if (at_fault(sample.t) && t_s - 0.5 * std::floor(2.0 * t_s) < 0.05)
        sample.accel_m_s2[2] = std::clamp(sample.accel_m_s2[2], -kFullScale_m_s2, kFullScale_m_s2);
      return true;
    };
  });
  expect_recovered();
  EXPECT_GT(told.mean_nis(), kSuspiciousNis);
}

TEST_F(Robustness, ImuSamplesMissing) {
  fly([n = 0](Feed& feed) mutable {
    feed.on_imu = [&n](ImuSample& sample) { return !at_fault(sample.t) || ++n % 50 >= 12; };  // 48 ms of 200
  });
  expect_recovered();
  EXPECT_GT(told.images_unused, 0U);  // those that came in a hole
  EXPECT_EQ(counters.imu_gaps, 0U);
}

// Rotors: 9 m/s^2 and half a radian per second, too fast for the IMU's rate to show.
TEST_F(Robustness, Vibration) {
  fly([](Feed& feed) {
    feed.on_imu = [](ImuSample& sample) {
      const double phase = 2.0 * M_PI * 113.0 * (sample.t - sim::flight_epoch()).seconds();
      if (!at_fault(sample.t)) return true;
      for (std::size_t k = 0; k < 3; ++k) {
        sample.accel_m_s2[k] += 9.0 * std::sin(phase + static_cast<double>(k));
        sample.gyro_rad_s[k] += 0.5 * std::sin(phase + 2.0 * static_cast<double>(k));
      }
      return true;
    };
  });
  expect_recovered();
  EXPECT_GT(told.mean_nis(), kSuspiciousNis);
}

}  // namespace
}  // namespace plumb
