#include "fsw/estimator/stillness.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>

#include "test/support/property.h"

namespace plumb {
namespace {

constexpr std::size_t kTracks = 60;
constexpr double kGravity = 9.80665;
constexpr double kFocal_px = 400.0;
constexpr double kImageRate_Hz = 30.0;
constexpr double kImuRate_Hz = 250.0;
using Frame = FeatureFrame<kTracks>;

/// A flight over level ground by a camera that looks straight down, level all the time: position and acceleration.
struct Flight {
  std::function<Vec3(double)> position;
  Vec3 acceleration = Vec3::Zero();
  double ground_half_m = 3.0;  ///< half the side of the square of ground that features lie on
};

ImuSample imu_at(const Flight& flight, double t_s, test::Generator& g) {
  ImuSample s;
  s.t = Time::from_seconds(t_s);
  Eigen::Map<Vec3>(s.gyro_rad_s.data()) = Vec3(0.002, -0.001, 0.003) + g.normal_vector<3>(0.002);
  Eigen::Map<Vec3>(s.accel_m_s2.data()) = flight.acceleration + Vec3(0.0, 0.0, kGravity) + g.normal_vector<3>(0.02);
  return s;
}

Frame frame_at(const Flight& flight, double t_s, double noise_px, test::Generator& g) {
  Frame frame;
  frame.t = Time::from_seconds(t_s);
  const Vec3 p = flight.position(t_s);
  test::Generator layout(99);  // the same points on the ground for every frame
  for (std::uint32_t id = 0; id < kTracks; ++id) {
    const Vec2 point = flight.ground_half_m * Vec2(layout.uniform(-1.0, 1.0), layout.uniform(-1.0, 1.0));
    FeatureObservation o;
    o.track_id = id;
    o.x = (point.x() - p.x()) / p.z() + g.normal(noise_px / kFocal_px);
    o.y = -(point.y() - p.y()) / p.z() + g.normal(noise_px / kFocal_px);
    EXPECT_EQ(frame.observations.push_back(o), Status::kOk);
  }
  return frame;
}

/// Of a 640 x 480 image.
SensorCalibration lens() {
  SensorCalibration calibration;
  calibration.focal_px = kFocal_px;
  calibration.half_fov_x = 0.8;
  calibration.half_fov_y = 0.6;
  return calibration;
}

struct Verdict {
  bool ever_imu = false;
  bool ever_image = false;
  bool ever_both = false;
  bool both_at_the_end = false;
};

Verdict judge(const Flight& flight, double length_s, double noise_px, test::Generator& g) {
  const EstimatorOptions options;
  const auto imu = std::make_unique<ImuBuffer>();
  ImageStillness<kTracks> images(options.start, lens());
  Verdict v;
  int samples = 0;
  for (int k = 1; k < static_cast<int>(length_s * kImageRate_Hz); ++k) {
    const double t_s = k / kImageRate_Hz;
    for (; samples / kImuRate_Hz <= t_s + 0.01; ++samples) {
      EXPECT_EQ(imu->push(imu_at(flight, samples / kImuRate_Hz, g)), Status::kOk);
    }
    const Frame frame = frame_at(flight, t_s, noise_px, g);
    const bool image = images.update(frame).still;
    const bool inertial =
        imu_is_still(*imu, frame.t - Duration::from_seconds(options.start.still_window_s), frame.t, options);
    v.ever_imu |= inertial;
    v.ever_image |= image;
    v.ever_both |= inertial && image;
    v.both_at_the_end = inertial && image;
  }
  return v;
}

TEST(Stillness, StandingStillIsSeen) {
  test::for_all(10, [](test::Generator& g) {
    const double height = g.uniform(0.3, 20.0);
    const Flight flight{[height](double) { return Vec3(0.0, 0.0, height); }, Vec3::Zero(), 0.7 * height};
    EXPECT_TRUE(judge(flight, 5.0, 0.5, g).both_at_the_end);
  });
}

// A smooth flight looks still to the IMU and a far scene nearly still to the camera; together they must not be fooled.
// The slow climb is the one that made the reference's peers set the velocity to zero in the air.
TEST(Stillness, AConstantVelocityIsNotStanding) {
  test::for_all(20, [](test::Generator& g) {
    const double height = g.uniform(1.0, 12.0);
    const Vec3 velocity = g.uniform(0.3, 2.0) * g.direction();
    const Flight flight{[=](double t_s) { return Vec3(Vec3(0.0, 0.0, height + 4.0) + velocity * t_s * 0.5); }};
    const Verdict v = judge(flight, 4.0, 0.5, g);
    EXPECT_TRUE(v.ever_imu);  // the IMU alone cannot tell
    EXPECT_FALSE(v.ever_both);
  });
}

TEST(Stillness, ASlowClimbIsNotStanding) {
  test::for_all(10, [](test::Generator& g) {
    const Flight flight{[](double t_s) { return Vec3(0.0, 0.0, 2.0 + 0.2 * t_s); }};
    EXPECT_FALSE(judge(flight, 6.0, 0.5, g).ever_both);
  });
}

TEST(Stillness, AConstantAccelerationIsNotStanding) {
  test::for_all(20, [](test::Generator& g) {
    const Vec3 acceleration = g.uniform(0.2, 2.0) * g.direction();
    // From a moment of rest: the velocity is zero at first, the acceleration never is.
    const Flight flight{[=](double t_s) { return Vec3(Vec3(0.0, 0.0, 8.0) + 0.5 * acceleration * t_s * t_s); },
                        acceleration};
    EXPECT_FALSE(judge(flight, 2.0, 0.5, g).ever_both);
  });
}

TEST(Stillness, TurningAndShakingAreNotStillToTheImu) {
  test::for_all(20, [](test::Generator& g) {
    const EstimatorOptions options;
    const bool turning = g.integer(0, 1) == 0;
    const Vec3 axis = g.direction();
    const auto imu = std::make_unique<ImuBuffer>();
    for (int k = 0; k <= 250; ++k) {
      const double t_s = k / kImuRate_Hz;
      ImuSample s;
      s.t = Time::from_seconds(t_s);
      const double shake = std::sin(50.0 * t_s);
      Eigen::Map<Vec3>(s.gyro_rad_s.data()) = turning ? Vec3(0.25 * axis) : Vec3::Zero();
      Eigen::Map<Vec3>(s.accel_m_s2.data()) =
          Vec3(0.0, 0.0, kGravity) + (turning ? Vec3::Zero() : Vec3(0.5 * shake * axis));
      ASSERT_EQ(imu->push(s), Status::kOk);
    }
    EXPECT_FALSE(imu_is_still(*imu, Time::from_seconds(0.4), Time::from_seconds(0.9), options));
  });
}

/// The verdict on an IMU that reads the same all the time but for `shake`, from 0.4 to 0.9 s of `seen_s` seconds.
bool still_to_the_imu(double rate_hz, double seen_s, const Vec3& accel,
                      const std::function<ImuSample(ImuSample)>& shake, const EstimatorOptions& options = {}) {
  const auto imu = std::make_unique<ImuBuffer>();
  for (int k = 0; k / rate_hz <= seen_s; ++k) {
    ImuSample s;
    s.t = Time::from_seconds(k / rate_hz);
    Eigen::Map<Vec3>(s.accel_m_s2.data()) = accel;
    EXPECT_EQ(imu->push(shake(s)), Status::kOk);
  }
  return imu_is_still(*imu, Time::from_seconds(0.4), Time::from_seconds(0.9), options);
}
const auto kNoShake = [](ImuSample s) { return s; };
const Vec3 kRest(0.0, 0.0, kGravity);

TEST(Stillness, EveryPartOfTheImuCanSayThatItMoves) {
  test::for_all(20, [](test::Generator& g) {
    const Vec3 axis = g.direction();
    const double amplitude = g.uniform(0.1, 1.0);
    ASSERT_TRUE(still_to_the_imu(kImuRate_Hz, 1.0, kRest, kNoShake));
    EXPECT_FALSE(still_to_the_imu(kImuRate_Hz, 1.0, kRest, [&](ImuSample s) {
      Eigen::Map<Vec3>(s.gyro_rad_s.data()) += amplitude * std::sin(50.0 * s.t.seconds()) * axis;  // turns to and fro
      return s;
    }));
    EXPECT_FALSE(still_to_the_imu(kImuRate_Hz, 1.0, g.uniform(1.06, 1.3) * kRest, kNoShake));  // climbs, ever faster
    EXPECT_FALSE(still_to_the_imu(kImuRate_Hz, 1.0, g.uniform(0.7, 0.94) * kRest, kNoShake));
  });
}

TEST(Stillness, PartOfAWindowOrAFewSamplesAreNoEvidence) {
  EXPECT_FALSE(still_to_the_imu(kImuRate_Hz, 0.85, kRest, kNoShake));  // nothing is known of the end
  EXPECT_FALSE(still_to_the_imu(10.0, 1.0, kRest, kNoShake));
}

// An IMU that is noisier than the limits stands still all the same, if its noise is known.
TEST(Stillness, TheNoiseOfTheImuIsNoMotion) {
  test::for_all(10, [](test::Generator& g) {
    EstimatorOptions noisy;
    noisy.imu.gyro_noise_density = noisy.start.still_gyro_rad_s / std::sqrt(kImuRate_Hz);
    noisy.imu.accel_noise_density = noisy.start.still_accel_m_s2 / std::sqrt(kImuRate_Hz);
    const auto noise = [&](ImuSample s) {
      Eigen::Map<Vec3>(s.gyro_rad_s.data()) += g.normal_vector<3>(noisy.start.still_gyro_rad_s);
      Eigen::Map<Vec3>(s.accel_m_s2.data()) += g.normal_vector<3>(noisy.start.still_accel_m_s2);
      return s;
    };
    EXPECT_TRUE(still_to_the_imu(kImuRate_Hz, 1.0, kRest, noise, noisy));
    EXPECT_FALSE(still_to_the_imu(kImuRate_Hz, 1.0, kRest, noise));
  });
}

TEST(Stillness, WithoutSamplesNothingIsStill) {
  const auto imu = std::make_unique<ImuBuffer>();
  EXPECT_FALSE(imu_is_still(*imu, Time::from_seconds(0.0), Time::from_seconds(0.5), EstimatorOptions{}));
}

TEST(Stillness, ImagesNeedAWindowAndFeatures) {
  test::for_all(5, [](test::Generator& g) {
    ImageStillness<kTracks> images(StartOptions{}, lens());
    const Flight flight{[](double) { return Vec3(0.0, 0.0, 5.0); }};
    for (int k = 0; k < 14; ++k) {
      EXPECT_FALSE(images.update(frame_at(flight, k / kImageRate_Hz, 0.0, g)).still) << k;
    }
    EXPECT_TRUE(images.update(frame_at(flight, 0.6, 0.0, g)).still);
    Frame sparse = frame_at(flight, 0.7, 0.0, g);
    sparse.observations.resize(7);
    EXPECT_FALSE(images.update(sparse).still);
    images.clear();
    EXPECT_FALSE(images.update(frame_at(flight, 5.0, 0.0, g)).still);
  });
}

TEST(Stillness, ClearedImagesAreNoEvidence) {
  test::for_all(1, [](test::Generator& g) {
    ImageStillness<kTracks> images(StartOptions{}, lens());
    const Flight flight{[](double) { return Vec3(0.0, 0.0, 5.0); }};
    for (int k = 0; k < 30; ++k) images.update(frame_at(flight, k / kImageRate_Hz, 0.0, g));
    ASSERT_TRUE(images.update(frame_at(flight, 1.0, 0.0, g)).still);
    images.clear();
    EXPECT_FALSE(images.update(frame_at(flight, 1.1, 0.0, g)).still);
  });
}

// A field of flow of every smooth kind is measured as its size; a few features that go their own way do not hide it.
// What is remembered of images decides on standing still in the next one, so it belongs to the estimator's hash.
TEST(Stillness, TheHashIsThatOfTheReference) {
  const Flight flight{.position = [](double) { return Vec3(0.0, 0.0, 5.0); }};
  const auto hash_after = [&flight](double first_s, double second_s) {
    test::Generator g(7);
    ImageStillness<kTracks> images(StartOptions{}, lens());
    images.update(frame_at(flight, first_s, 0.0, g));
    images.update(frame_at(flight, second_s, 0.0, g));
    Hash64 hash;
    images.add_to(hash);
    return hash.value();
  };
  EXPECT_EQ(hash_after(1.0, 1.2), hash_after(1.0, 1.2));
  EXPECT_NE(hash_after(1.0, 1.2), hash_after(1.1, 1.2));
  EXPECT_NE(hash_after(1.0, 1.2), hash_after(1.0, 1.9));  // long enough to be still
}

TEST(Stillness, SmoothFlowIsTheSizeOfTheField) {
  test::for_all(200, [](test::Generator& g) {
    const Mat2 linear = 0.01 * (Mat2() << g.normal(1.0), g.normal(1.0), g.normal(1.0), g.normal(1.0)).finished();
    const Vec2 shift = g.normal_vector<2>(0.01);
    std::array<Displacement, 50> d;
    const Vec2 half(0.8, 0.6);
    const double spread = g.uniform(0.05, 1.0);  // huddled features tell the field as well as spread ones
    for (Displacement& one : d) {
      one.from = spread * Vec2(g.uniform(-half.x(), half.x()), g.uniform(-half.y(), half.y()));
      one.by = linear * one.from + shift;
    }
    double sum = 0.0;  // over a grid as fine as the image
    constexpr int kGrid = 200;
    for (int i = 0; i < kGrid * kGrid; ++i) {
      const Vec2 at(half.x() * (2.0 * (i % kGrid + 0.5) / kGrid - 1.0),
                    half.y() * (2.0 * (i / kGrid + 0.5) / kGrid - 1.0));
      sum += (linear * at + shift).squaredNorm();
    }
    const double rms = std::sqrt(sum / (kGrid * kGrid));
    EXPECT_NEAR(smooth_flow_rms(d.data(), d.size(), half), rms, 1e-4 * rms);
    d[7].by += Vec2(0.5, 0.0);
    d[21].by += Vec2(0.0, -0.5);
    if (spread > 0.7) {
      EXPECT_NEAR(smooth_flow_rms(d.data(), d.size(), half), rms, 0.1 * rms);
    }
  });
}

// In a climb the features of the start huddle in the middle of the image, where hardly anything moves.
TEST(Stillness, HuddledFeaturesAreNoEvidenceOfStandingStill) {
  test::for_all(20, [](test::Generator& g) {
    ImageStillness<kTracks> images(StartOptions{}, lens());
    const double climb_m_s = g.uniform(0.2, 0.5);
    const double spread_m = g.uniform(0.2, 0.5);
    const std::vector<Vec2> ground = [&] {
      std::vector<Vec2> points(kTracks);
      for (Vec2& point : points) point = g.normal_vector<2>(spread_m);
      return points;
    }();
    for (int k = 0; k < 120; ++k) {
      Frame frame;
      frame.t = Time::from_seconds(k / kImageRate_Hz);
      const double height_m = 10.0 + climb_m_s * k / kImageRate_Hz;
      for (std::uint32_t i = 0; i < kTracks; ++i) {
        const Vec2 z = ground[i] / height_m + g.normal_vector<2>(0.5 / kFocal_px);
        static_cast<void>(frame.observations.push_back({i, 0.0F, 0.0F, z.x(), z.y()}));
      }
      EXPECT_FALSE(images.update(frame).still) << k;
    }
  });
}

TEST(Stillness, ALineOfFeaturesDeterminesNoField) {
  std::array<Displacement, 20> d;
  for (std::size_t i = 0; i < d.size(); ++i) d[i].from = Vec2(0.01 * static_cast<double>(i), 0.3);
  EXPECT_TRUE(std::isinf(smooth_flow_rms(d.data(), d.size(), Vec2(0.8, 0.6))));
}

}  // namespace
}  // namespace plumb
