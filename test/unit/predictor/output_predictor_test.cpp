#include "fsw/predictor/output_predictor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "test/support/property.h"

namespace plumb {
namespace {

constexpr double kGravity = 9.80665;
const Vec3 kUp(0.0, 0.0, kGravity);

Time at(double s) { return Time::from_seconds(s); }

// Constant acceleration in W and constant turn about a fixed axis: closed form for position, velocity and attitude, and
// for what an ideal IMU measures.
struct Motion {
  Vec3 p0_m{1.0, -2.0, 3.0};
  Vec3 v0_m_s{0.5, 0.2, -0.1};
  Vec3 a_m_s2{0.3, -0.4, 0.2};
  Quat q0 = so3_exp(Vec3(0.3, -0.2, 0.5));
  Vec3 omega_rad_s{0.2, 0.1, -0.4};
  Vec3 b_gyro_rad_s{0.01, -0.02, 0.005};
  Vec3 b_accel_m_s2{0.05, 0.02, -0.08};

  Quat q(double t) const { return q0 * so3_exp(omega_rad_s * t); }
  Vec3 p(double t) const { return p0_m + v0_m_s * t + 0.5 * a_m_s2 * t * t; }
  Vec3 v(double t) const { return v0_m_s + a_m_s2 * t; }

  ImuSample sample(double t) const {
    const Vec3 gyro = omega_rad_s + b_gyro_rad_s;
    const Vec3 accel = q(t).conjugate() * (a_m_s2 + kUp) + b_accel_m_s2;
    return {.t = at(t), .gyro_rad_s = {gyro.x(), gyro.y(), gyro.z()}, .accel_m_s2 = {accel.x(), accel.y(), accel.z()}};
  }
  NavState state(double t) const {
    NavState s;
    s.t = at(t);
    s.valid = true;
    s.t_vision = s.t;
    const Quat rotation = q(t);
    const Vec3 position = p(t);
    const Vec3 velocity = v(t);
    s.q_WI = {rotation.w(), rotation.x(), rotation.y(), rotation.z()};
    for (int i = 0; i < 3; ++i) {
      const auto k = static_cast<std::size_t>(i);
      s.p_WI_m[k] = position(i);
      s.v_WI_m_s[k] = velocity(i);
      s.b_gyro_rad_s[k] = b_gyro_rad_s(i);
      s.b_accel_m_s2[k] = b_accel_m_s2(i);
    }
    s.covariance[0] = 0.25;
    return s;
  }
};

void expect_on(const Motion& motion, const NavState& state, double tolerance) {
  const double t = state.t.seconds();
  const Quat q(state.q_WI[0], state.q_WI[1], state.q_WI[2], state.q_WI[3]);
  EXPECT_LT(so3_log(motion.q(t).conjugate() * q).norm(), tolerance);
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(state.p_WI_m[static_cast<std::size_t>(i)], motion.p(t)(i), tolerance);
    EXPECT_NEAR(state.v_WI_m_s[static_cast<std::size_t>(i)], motion.v(t)(i), tolerance);
  }
}

constexpr double kStep_s = 0.005;
// A turning accelerometer is not linear between samples, as the integration takes it to be: about |omega|^2 g step^2 /
// 12, 4e-6 m/s^2 here.
constexpr double kAfterTenthSecond = 1e-6;
constexpr double kAfterSecond = 2e-5;
constexpr double kAfterFiveSeconds = 2e-4;

TEST(OutputPredictor, HasNoStateBeforeTheFirstCorrection) {
  const Motion motion;
  OutputPredictor predictor({});
  EXPECT_FALSE(predictor.state().valid);
  EXPECT_EQ(predictor.correct(motion.state(0.0)), Status::kStale);  // no IMU yet
  EXPECT_EQ(predictor.add_imu(motion.sample(0.0)), Status::kOk);
  EXPECT_FALSE(predictor.state().valid);
}

TEST(OutputPredictor, FollowsConstantAccelerationAndTurn) {
  const Motion motion;
  OutputPredictor predictor({.gravity_m_s2 = kGravity});
  ASSERT_EQ(predictor.add_imu(motion.sample(0.0)), Status::kOk);
  ASSERT_EQ(predictor.correct(motion.state(0.0)), Status::kOk);
  for (int i = 1; i <= 200; ++i) {
    ASSERT_EQ(predictor.add_imu(motion.sample(i * kStep_s)), Status::kOk);
    EXPECT_EQ(predictor.state().t, at(i * kStep_s));
    expect_on(motion, predictor.state(), kAfterSecond);
  }
}

TEST(OutputPredictor, CarriesALateCorrectionToNow) {
  const Motion motion;
  OutputPredictor predictor({.gravity_m_s2 = kGravity});
  for (int i = 0; i <= 40; ++i) ASSERT_EQ(predictor.add_imu(motion.sample(i * kStep_s)), Status::kOk);
  ASSERT_EQ(predictor.correct(motion.state(0.1037)), Status::kOk);  // between two samples
  EXPECT_EQ(predictor.state().t, at(40 * kStep_s));
  EXPECT_EQ(predictor.corrected_at(), at(0.1037));
  expect_on(motion, predictor.state(), kAfterTenthSecond);
  EXPECT_EQ(predictor.state().covariance[0], 0.25);
  EXPECT_EQ(predictor.state().t_vision, at(0.1037));
}

TEST(OutputPredictor, TakesACorrectionAheadOfTheNewestSample) {
  const Motion motion;
  OutputPredictor predictor({.gravity_m_s2 = kGravity});
  ASSERT_EQ(predictor.add_imu(motion.sample(0.0)), Status::kOk);
  ASSERT_EQ(predictor.correct(motion.state(0.003)), Status::kOk);
  EXPECT_EQ(predictor.state().t, at(0.003));
  ASSERT_EQ(predictor.add_imu(motion.sample(kStep_s)), Status::kOk);
  expect_on(motion, predictor.state(), kAfterTenthSecond);
}

// The law of the predictor: wherever and however often it is corrected, the output is what one integration from the
// last correction over all samples since gives, bit by bit.
TEST(OutputPredictor, EqualsOneIntegrationFromTheLastCorrection) {
  test::for_all(50, [](test::Generator& g) {
    const Motion motion;
    std::vector<ImuSample> samples;
    double t = 0.0;
    for (int i = 0; i < 100; ++i, t += g.uniform(0.001, 0.009)) {
      samples.push_back(motion.sample(t));
      for (double& rate : samples.back().gyro_rad_s) rate += g.normal(0.1);
    }
    OutputPredictor often({});
    NavState last;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      ASSERT_EQ(often.add_imu(samples[i]), Status::kOk);
      if (i % 10 != 9) continue;
      last = motion.state(samples[i - 4].t.seconds() + g.uniform(0.0, 0.001));
      ASSERT_EQ(often.correct(last), Status::kOk);
    }
    OutputPredictor once({});
    for (const ImuSample& sample : samples) ASSERT_EQ(once.add_imu(sample), Status::kOk);
    ASSERT_EQ(once.correct(last), Status::kOk);
    EXPECT_EQ(often.state().p_WI_m, once.state().p_WI_m);
    EXPECT_EQ(often.state().v_WI_m_s, once.state().v_WI_m_s);
    EXPECT_EQ(often.state().q_WI, once.state().q_WI);
  });
}

TEST(OutputPredictor, ReportsTheJumpOfACorrection) {
  const Motion motion;
  OutputPredictor predictor({.gravity_m_s2 = kGravity});
  for (int i = 0; i <= 10; ++i) ASSERT_EQ(predictor.add_imu(motion.sample(i * kStep_s)), Status::kOk);
  ASSERT_EQ(predictor.correct(motion.state(0.02)), Status::kOk);
  EXPECT_EQ(predictor.tracking().position_m, 0.0);  // nothing to compare the first one with
  NavState moved = motion.state(0.03);
  moved.p_WI_m[1] += 0.5;
  ASSERT_EQ(predictor.correct(moved), Status::kOk);
  EXPECT_NEAR(predictor.tracking().position_m, 0.5, kAfterTenthSecond);
  EXPECT_NEAR(predictor.tracking().velocity_m_s, 0.0, kAfterTenthSecond);
  EXPECT_NEAR(predictor.tracking().attitude_rad, 0.0, kAfterTenthSecond);
}

TEST(OutputPredictor, RefusesBadSamplesAndCounts) {
  const Motion motion;
  OutputPredictor predictor({});
  ASSERT_EQ(predictor.add_imu(motion.sample(0.0)), Status::kOk);
  EXPECT_EQ(predictor.add_imu(motion.sample(0.0)), Status::kOutOfOrder);
  ImuSample bad = motion.sample(kStep_s);
  bad.accel_m_s2[2] = std::nan("");
  EXPECT_EQ(predictor.add_imu(bad), Status::kInvalidValue);
  EXPECT_EQ(predictor.counters().refused_samples, 2U);
}

TEST(OutputPredictor, StopsAcrossAGapUntilCorrected) {
  const Motion motion;
  OutputPredictor predictor({.gravity_m_s2 = kGravity, .max_gap_s = 0.1});
  ASSERT_EQ(predictor.add_imu(motion.sample(0.0)), Status::kOk);
  ASSERT_EQ(predictor.correct(motion.state(0.0)), Status::kOk);
  ASSERT_EQ(predictor.add_imu(motion.sample(0.2)), Status::kOk);
  EXPECT_FALSE(predictor.state().valid);
  EXPECT_EQ(predictor.counters().gaps, 1U);
  EXPECT_EQ(predictor.correct(motion.state(0.1)), Status::kStale);  // inside the hole
  ASSERT_EQ(predictor.add_imu(motion.sample(0.205)), Status::kOk);
  ASSERT_EQ(predictor.correct(motion.state(0.201)), Status::kOk);
  expect_on(motion, predictor.state(), kAfterTenthSecond);
}

TEST(OutputPredictor, RefusesOldAndImpossibleCorrections) {
  const Motion motion;
  OutputPredictor predictor({.gravity_m_s2 = kGravity});
  const int samples = static_cast<int>(OutputPredictor::kMaxSamples) + 100;
  for (int i = 0; i < samples; ++i) ASSERT_EQ(predictor.add_imu(motion.sample(i * kStep_s)), Status::kOk);
  EXPECT_EQ(predictor.correct(motion.state(99 * kStep_s)), Status::kStale);  // overwritten
  ASSERT_EQ(predictor.correct(motion.state(101 * kStep_s)), Status::kOk);
  expect_on(motion, predictor.state(), kAfterFiveSeconds);
  EXPECT_EQ(predictor.correct(motion.state(100 * kStep_s)), Status::kOutOfOrder);
  EXPECT_EQ(predictor.counters().stale_corrections, 2U);
  EXPECT_TRUE(predictor.state().valid);
  NavState broken = motion.state(102 * kStep_s);
  broken.v_WI_m_s[0] = std::nan("");
  EXPECT_EQ(predictor.correct(broken), Status::kNumericalFault);
  EXPECT_FALSE(predictor.state().valid);
}

TEST(OutputPredictor, FollowsTheEstimatorIntoAndOutOfAReset) {
  const Motion motion;
  OutputPredictor predictor({.gravity_m_s2 = kGravity});
  for (int i = 0; i <= 20; ++i) ASSERT_EQ(predictor.add_imu(motion.sample(i * kStep_s)), Status::kOk);
  ASSERT_EQ(predictor.correct(motion.state(0.09)), Status::kOk);
  ASSERT_EQ(predictor.correct(NavState{}), Status::kOk);
  EXPECT_FALSE(predictor.state().valid);
  NavState restarted = motion.state(0.095);
  restarted.reset_count = 1;
  ASSERT_EQ(predictor.correct(restarted), Status::kOk);
  EXPECT_EQ(predictor.state().reset_count, 1U);
  expect_on(motion, predictor.state(), kAfterTenthSecond);
  EXPECT_EQ(predictor.tracking().position_m, 0.0);  // a restart is no tracking error
}

}  // namespace
}  // namespace plumb
