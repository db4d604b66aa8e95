#include "fsw/modes/reliability.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <limits>

#include "test/support/property.h"

namespace plumb {
namespace {

using Mat15 = Eigen::Matrix<double, 15, 15, Eigen::RowMajor>;

constexpr DriftModel kModel{.accel_noise_density = 2e-3, .gyro_noise_density = 2e-4};

NavState state_with(const Mat15& covariance, const Eigen::Quaterniond& q) {
  NavState state;
  state.valid = true;
  state.q_WI = {q.w(), q.x(), q.y(), q.z()};
  Eigen::Map<Mat15>(state.covariance.data()) = covariance;
  return state;
}

Mat15 any_covariance(test::Generator& g) {
  Mat15 factor;
  const double scale[5] = {0.1, 0.03, 0.003, 0.0003, 0.02};
  for (int i = 0; i < 15; ++i) {
    for (int k = 0; k < 15; ++k) factor(i, k) = 0.3 * scale[i / 3] * g.normal(1.0);
  }
  return factor * factor.transpose();
}

Eigen::Quaterniond any_attitude(test::Generator& g) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(g.uniform(0.0, 3.0), g.direction()));
}

TEST(Reliability, AStateThatIsNoneIsNotReliable) {
  test::Generator g(test::base_seed());
  NavState state = state_with(any_covariance(g), any_attitude(g));
  EXPECT_GT(time_to_unreliable_s(state, kModel, {}), 0.0);
  state.covariance[0] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(time_to_unreliable_s(state, kModel, {}), 0.0);
  state = state_with(any_covariance(g), any_attitude(g));
  state.valid = false;
  EXPECT_EQ(time_to_unreliable_s(state, kModel, {}), 0.0);
}

TEST(Reliability, EndsWhereTheBoundPassesALimit) {
  test::for_all(200, [](test::Generator& g) {
    const ModeOptions options{.position_sigma_limit_m = g.uniform(0.5, 20.0),
                              .velocity_sigma_limit_m_s = g.uniform(0.1, 5.0)};
    const NavState state = state_with(any_covariance(g), any_attitude(g));
    const double time_s = time_to_unreliable_s(state, kModel, options);
    const StateSigmas now = sigmas_of(state);
    const auto within = [&](double tau_s) {
      const StateSigmas later = unaided_after(tau_s, now, kModel);
      return later.position_m <= options.position_sigma_limit_m &&
             later.velocity_m_s <= options.velocity_sigma_limit_m_s;
    };
    EXPECT_LE(time_s, options.horizon_s);
    EXPECT_TRUE(time_s == 0.0 || within(time_s));
    EXPECT_TRUE(time_s == options.horizon_s || !within(time_s + 1e-3));
  });
}

TEST(Reliability, FallsAsTheCovarianceGrows) {
  test::for_all(200, [](test::Generator& g) {
    const Mat15 small = any_covariance(g);
    const Mat15 large = small + any_covariance(g);
    const Eigen::Quaterniond q = any_attitude(g);
    EXPECT_LE(time_to_unreliable_s(state_with(large, q), kModel, {}),
              time_to_unreliable_s(state_with(small, q), kModel, {}));
  });
}

// Against the covariance itself, carried on without the bound: a body at rest, whose errors follow the linear model.
TEST(Reliability, TheBoundIsNeverBelowWhatTheCovarianceGrowsTo) {
  test::for_all(100, [](test::Generator& g) {
    const Mat15 start = any_covariance(g);
    const Eigen::Quaterniond q = any_attitude(g);
    const Eigen::Matrix3d r = q.toRotationMatrix();
    const Eigen::Vector3d up_I = r.transpose() * Eigen::Vector3d(0, 0, kModel.gravity_m_s2);
    Eigen::Matrix3d up_cross;
    up_cross << 0, -up_I.z(), up_I.y(), up_I.z(), 0, -up_I.x(), -up_I.y(), up_I.x(), 0;
    Mat15 f = Mat15::Zero();
    f.block<3, 3>(0, 3).setIdentity();
    f.block<3, 3>(3, 6) = -r * up_cross;
    f.block<3, 3>(3, 12) = -r;
    f.block<3, 3>(6, 9) = -Eigen::Matrix3d::Identity();
    Mat15 noise = Mat15::Zero();
    noise.block<3, 3>(3, 3).diagonal().setConstant(kModel.accel_noise_density * kModel.accel_noise_density);
    noise.block<3, 3>(6, 6).diagonal().setConstant(kModel.gyro_noise_density * kModel.gyro_noise_density);
    const StateSigmas now = sigmas_of(state_with(start, q));
    constexpr double kStep_s = 0.01;
    Mat15 p = start;
    for (int i = 1; i <= 1000; ++i) {
      const Mat15 phi = Mat15::Identity() + kStep_s * f + 0.5 * kStep_s * kStep_s * f * f;
      p = (phi * p * phi.transpose()).eval() + kStep_s * noise;
      if (i % 100 != 0) continue;
      const StateSigmas bound = unaided_after(kStep_s * i, now, kModel);
      constexpr double kRounding = 1.0 + 1e-3;  // of the steps
      for (int axis = 0; axis < 3; ++axis) {
        EXPECT_LE(std::sqrt(p(axis, axis)), kRounding * bound.position_m);
        EXPECT_LE(std::sqrt(p(3 + axis, 3 + axis)), kRounding * bound.velocity_m_s);
      }
    }
  });
}

// Of the attitude only what tilts gravity counts.
TEST(Reliability, AHeadingThatIsNotKnownDoesNotMatter) {
  test::for_all(50, [](test::Generator& g) {
    const Eigen::Quaterniond q = any_attitude(g);
    const Eigen::Vector3d up_I = q.conjugate() * Eigen::Vector3d::UnitZ();
    Mat15 p = Mat15::Zero();
    p.block<3, 3>(6, 6) = up_I * up_I.transpose();
    EXPECT_NEAR(sigmas_of(state_with(p, q)).tilt_rad, 0.0, 1e-7);
  });
}

}  // namespace
}  // namespace plumb
