// Starting in motion on windows whose truth is known in closed form.

#include "fsw/estimator/motion_start.h"

#include <gtest/gtest.h>

#include <memory>

#include "test/support/property.h"
#include "test/support/sim/imu_model.h"
#include "test/support/sim/rig.h"
#include "test/support/sim/scene.h"

namespace plumb {
namespace {

constexpr double kFirst_s = 2.0;
constexpr double kImuRate_Hz = 250.0;
constexpr double kNoise_px = 0.5;

struct Window {
  sim::Rig rig = sim::nadir_rig();
  sim::Trajectory trajectory;
  EstimatorOptions options;
  std::unique_ptr<ImuBuffer> imu = std::make_unique<ImuBuffer>();
  StartProblem problem;
  Vec3 gyro_bias = Vec3::Zero();
  Vec3 accel_bias = Vec3::Zero();

  explicit Window(const sim::Trajectory& flight) : trajectory(flight) {
    options.vision.pixel_noise_px = kNoise_px;
    options.start.gyro_bias_sigma_rad_s = 0.01;
    options.start.accel_bias_sigma_m_s2 = 0.05;
  }
  sim::TruthState first() const { return trajectory.at(kFirst_s); }
};

Time at(double t_s) { return Time::from_seconds(t_s); }

void add_imu(Window& w, double length_s, test::Generator& g) {
  w.gyro_bias = g.normal_vector<3>(w.options.start.gyro_bias_sigma_rad_s);
  w.accel_bias = g.normal_vector<3>(w.options.start.accel_bias_sigma_m_s2);
  const double gyro_noise = w.options.imu.gyro_noise_density * std::sqrt(kImuRate_Hz);
  const double accel_noise = w.options.imu.accel_noise_density * std::sqrt(kImuRate_Hz);
  for (int k = 0; k / kImuRate_Hz <= kFirst_s + length_s + 0.01; ++k) {
    const sim::TruthState truth = w.trajectory.at(k / kImuRate_Hz);
    const Vec3 up(0.0, 0.0, w.options.imu.gravity_m_s2);
    ImuSample s;
    s.t = at(k / kImuRate_Hz);
    Eigen::Map<Vec3>(s.gyro_rad_s.data()) = truth.omega_I_rad_s + w.gyro_bias + g.normal_vector<3>(gyro_noise);
    Eigen::Map<Vec3>(s.accel_m_s2.data()) =
        truth.q_WI.conjugate() * (truth.a_WI_m_s2 + up) + w.accel_bias + g.normal_vector<3>(accel_noise);
    ASSERT_EQ(w.imu->push(s), Status::kOk);
  }
}

Vec3 in_camera(const Window& w, double t_s, const Vec3& point) {
  const sim::TruthState truth = w.trajectory.at(t_s);
  return w.rig.q_WC(truth).conjugate() * (point - w.rig.p_WC_m(truth));
}

Vec2 observe(const Window& w, double t_s, const Vec3& point, test::Generator& g) {
  return in_camera(w, t_s, point).hnormalized() + g.normal_vector<2>(kNoise_px / 400.0);
}

/// Features on the level ground, all in view of the last image; those seen in at least three earlier ones are used.
void add_images(Window& w, double length_s, test::Generator& g) {
  constexpr std::size_t kImages = 10;
  std::array<double, kImages> times{};
  for (std::size_t i = 0; i < kImages; ++i) {
    times[i] = kFirst_s + length_s * static_cast<double>(i) / (kImages - 1);
    ASSERT_EQ(w.problem.images.push_back(at(times[i])), Status::kOk);
  }
  const sim::TruthState last = w.trajectory.at(times.back());
  while (!w.problem.features.full()) {
    const Vec2 z(g.uniform(-0.75, 0.75), g.uniform(-0.55, 0.55));
    const Vec3 ray = w.rig.q_WC(last) * z.homogeneous();
    const Vec3 point = w.rig.p_WC_m(last) - ray * (w.rig.p_WC_m(last).z() / ray.z());
    StartFeature feature;
    feature.anchor_z = observe(w, times.back(), point, g);
    for (std::size_t i = 0; i + 1 < kImages; ++i) {
      const Vec2 seen = observe(w, times[i], point, g);
      if (std::abs(seen.x()) > 0.8 || std::abs(seen.y()) > 0.6) continue;
      ASSERT_EQ(feature.earlier.push_back({i, seen}), Status::kOk);
    }
    if (feature.earlier.size() < 3) continue;
    ASSERT_EQ(w.problem.features.push_back(feature), Status::kOk);
  }
}

void add_ranges(Window& w, double length_s, test::Generator& g) {
  for (int k = 0; k < 10; ++k) {
    const double t_s = kFirst_s + length_s * (k + 0.5) / 10.0;
    const sim::TruthState truth = w.trajectory.at(t_s);
    const double range_m = -w.rig.beam_origin_m(truth).z() / w.rig.beam_direction(truth).z();
    ASSERT_EQ(w.problem.ranges.push_back({at(t_s), range_m + g.normal(0.03)}), Status::kOk);
  }
}

Result<StartSolution> solve(const Window& w) {
  const auto start = std::make_unique<MotionStart>(w.options, w.rig.calibration());
  return start->solve(w.problem, *w.imu);
}

/// Velocity in the body's own frame: free of the heading, which nobody knows.
Vec3 body_velocity(const Quat& q_WI, const Vec3& v) { return q_WI.conjugate() * v; }

double velocity_error(const Window& w, const StartSolution& s) {
  const sim::TruthState truth = w.first();
  return (body_velocity(s.core.motion.q_WI, s.core.motion.v_WI_m_s) - body_velocity(truth.q_WI, truth.v_WI_m_s)).norm();
}

sim::Trajectory lively(double height_m) {
  sim::Trajectory flight(Vec3(0.0, 0.0, height_m), 10.0);
  flight.lean(1.0)
      .change_speed(-4.0, 2.0, {0.6, 0.2, 0.0})
      .oscillate(-10.0, 30.0, {0.35, 0.0, 0.0}, 0.0, 0.9)
      .oscillate(-10.0, 30.0, {0.0, 0.3, 0.15}, 0.0, 0.7, 0.7);
  return flight;
}

sim::Trajectory cruise(double height_m, const Vec3& velocity) {
  sim::Trajectory flight(Vec3(0.0, 0.0, height_m), 10.0);
  flight.change_speed(-2.0, 1.0, velocity);
  return flight;
}

TEST(MotionStart, ExcitationGivesVelocityTiltAndBiasesWithinTheirSigmas) {
  test::for_all(12, [](test::Generator& g) {
    Window w(lively(g.uniform(2.0, 5.0)));
    add_imu(w, 1.2, g);
    add_images(w, 1.2, g);
    const Result<StartSolution> s = solve(w);
    ASSERT_TRUE(s.has_value());
    // The sigma of three axes together, so three of them is hardly ever passed.
    const Mat15& p = s->covariance;
    const auto sigma = [&p](std::size_t at) {
      return std::sqrt(p.diagonal().segment<3>(static_cast<Eigen::Index>(at)).sum());
    };
    EXPECT_LT(velocity_error(w, *s), 4.0 * s->velocity_sigma_m_s + 0.02);
    const Vec3 up = s->core.motion.q_WI.conjugate() * Vec3::UnitZ();
    EXPECT_LT((up - w.first().q_WI.conjugate() * Vec3::UnitZ()).norm(), 3.0 * sigma(kTheta));
    EXPECT_LT((s->core.b_gyro_rad_s - w.gyro_bias).norm(), 3.0 * sigma(kGyroBias));
    EXPECT_LT((s->core.b_accel_m_s2 - w.accel_bias).norm(), 3.0 * sigma(kAccelBias));
    EXPECT_LT(s->rms_px, 1.5 * kNoise_px);
    EXPECT_LT(s->core.motion.p_WI_m.norm(), 1e-5);
  });
}

/// A window of images and ranges at constant speed.
Window ranged_cruise(double speed_m_s, test::Generator& g) {
  Window w(cruise(g.uniform(3.0, 12.0), Vec3(speed_m_s, 0.0, 0.0)));
  add_imu(w, 1.2, g);
  add_images(w, 1.2, g);
  add_ranges(w, 1.2, g);
  return w;
}

TEST(MotionStart, RangesGiveTheSpeedOfAConstantFlight) {
  test::for_all(12, [](test::Generator& g) {
    const double speed = g.uniform(1.0, 4.0);
    Window w = ranged_cruise(speed, g);
    const Result<StartSolution> s = solve(w);
    ASSERT_TRUE(s.has_value());
    EXPECT_NEAR(s->core.motion.v_WI_m_s.norm(), speed, 0.08 * speed);
    EXPECT_GE(s->ranges_fitting(), 8U);
  });
}

// Images alone are the same for a world of any size, so a constant flight has its scale from the ranges: all of the
// steps must see them, or the answer would not follow them; the covariance too, or it would not know what they told.
TEST(MotionStart, TheRangesStandInEveryStepAndInTheCovariance) {
  test::for_all(12, [](test::Generator& g) {
    const double speed = g.uniform(1.0, 4.0);
    Window w = ranged_cruise(speed, g);
    const Result<StartSolution> s = solve(w);
    ASSERT_TRUE(s.has_value());
    EXPECT_LT(s->velocity_sigma_m_s, 0.1 * speed);
    EXPECT_LT(velocity_error(w, *s), 4.0 * s->velocity_sigma_m_s);

    const double stretch = g.uniform(0.8, 1.25);
    for (StartRange& range : w.problem.ranges) range.range_m *= stretch;
    const Result<StartSolution> stretched = solve(w);
    ASSERT_TRUE(stretched.has_value());
    EXPECT_NEAR(stretched->core.motion.v_WI_m_s.norm() / s->core.motion.v_WI_m_s.norm(), stretch, 0.02);
    EXPECT_GE(stretched->ranges_fitting(), 8U);
  });
}

TEST(MotionStart, RefusesAWindowWithoutFlow) {
  test::for_all(6, [](test::Generator& g) {
    Window w(cruise(5.0, Vec3::Zero()));
    add_imu(w, 1.0, g);
    add_images(w, 1.0, g);
    add_ranges(w, 1.0, g);
    EXPECT_EQ(solve(w).status(), Status::kIllConditioned);
  });
}

TEST(MotionStart, RefusesTooFewFeaturesOrImages) {
  test::for_all(1, [](test::Generator& g) {
    Window w(lively(4.0));
    add_imu(w, 1.0, g);
    add_images(w, 1.0, g);
    Window few = Window(lively(4.0));
    add_imu(few, 1.0, g);
    few.problem = w.problem;
    few.problem.features.resize(9);
    EXPECT_EQ(solve(few).status(), Status::kIllConditioned);
    few.problem = w.problem;
    few.problem.images.resize(2);
    EXPECT_EQ(solve(few).status(), Status::kIllConditioned);
  });
}

TEST(MotionStart, SurvivesOutliers) {
  test::for_all(8, [](test::Generator& g) {
    Window w(lively(3.0));
    add_imu(w, 1.2, g);
    add_images(w, 1.2, g);
    for (std::size_t k = 0; k < 4; ++k) {
      auto& earlier = w.problem.features[10 * k + 3].earlier;
      earlier[0].z += Vec2(g.uniform(-0.08, 0.08), g.uniform(-0.08, 0.08));
    }
    const Result<StartSolution> s = solve(w);
    ASSERT_TRUE(s.has_value());
    EXPECT_LT(velocity_error(w, *s), 0.25);
  });
}

TEST(MotionStart, RefusesFlowThatFitsNothing) {
  test::for_all(6, [](test::Generator& g) {
    Window w(lively(3.0));
    add_imu(w, 1.0, g);
    add_images(w, 1.0, g);
    for (StartFeature& f : w.problem.features) {
      for (StartObservation& o : f.earlier) o.z += g.normal_vector<2>(0.05);
    }
    EXPECT_EQ(solve(w).status(), Status::kRejected);
  });
}

TEST(MotionStart, ThePriorIsSymmetricAndPinsPlaceAndHeading) {
  test::for_all(6, [](test::Generator& g) {
    Window w(lively(3.0));
    add_imu(w, 1.0, g);
    add_images(w, 1.0, g);
    const Result<StartSolution> s = solve(w);
    ASSERT_TRUE(s.has_value());
    EXPECT_EQ(s->covariance, Mat15(s->covariance.transpose()));
    EXPECT_GT(s->covariance.diagonal().minCoeff(), 0.0);
    EXPECT_LT(s->covariance(2, 2), 1e-10);
    for (Eigen::Index k = 3; k < 6; ++k) EXPECT_LT(s->covariance(k, k), 1e-10);
  });
}

}  // namespace
}  // namespace plumb
