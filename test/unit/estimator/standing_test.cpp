// The rows of standing still against dense updates whose Jacobians are differences of the true retraction.

#include "fsw/estimator/standing.h"

#include <gtest/gtest.h>

#include <memory>

#include "test/support/dense_filter.h"

namespace plumb {
namespace {

using test::Dense;
using test::dense;
using test::TinyConfig;
using State = FilterState<TinyConfig>;
using Stack = UpdateStack<TinyConfig>;

/// A vehicle that stands, give or take what the prior leaves open.
std::unique_ptr<State> standing_state(test::Generator& g) {
  auto state = std::make_unique<State>();
  test::fill_state(g, test::nadir_calibration(), 2, *state);
  state->core.motion.v_WI_m_s = g.normal_vector<3>(0.02);
  state->core.motion.q_WI = test::any_attitude(g);
  return state;
}

/// The measurement that `predict` describes must do to the state what the rows on the stack do.
template <typename Predict>
void expect_dense_update(State& state, Stack& stack, const Vec3& measured, double sigma, Predict predict) {
  const Dense h = test::numeric_state_jacobian(state, 3, predict);
  const Eigen::VectorXd r = measured - predict(state);
  const test::DensePosterior expected =
      test::dense_update(dense(state.covariance()), {h, r, Eigen::VectorXd::Constant(3, sigma)});
  State moved = state;
  moved.retract(expected.dx.data());
  ASSERT_EQ(stack.apply(state), Status::kOk);
  test::expect_same_nominal(state, moved, 1e-7);
  EXPECT_LT(test::covariance_difference(expected.p, dense(state.covariance())), 1e-6);
}

TEST(Standing, ZeroVelocityIsAMeasurementOfTheVelocity) {
  const auto stack = std::make_unique<Stack>();
  test::for_all(30, [&](test::Generator& g) {
    const auto state = standing_state(g);
    stack->begin(*state);
    ASSERT_EQ(add_zero_velocity(*state, *stack, 0.01), Status::kOk);
    expect_dense_update(*state, *stack, Vec3::Zero(), 0.01,
                        [](const State& s) { return Vec3(s.core.motion.q_WI.conjugate() * s.core.motion.v_WI_m_s); });
  });
}

TEST(Standing, ZeroRateIsAMeasurementOfTheGyroBias) {
  const auto stack = std::make_unique<Stack>();
  test::for_all(30, [&](test::Generator& g) {
    const auto state = standing_state(g);
    const Vec3 mean = g.normal_vector<3>(0.02);
    stack->begin(*state);
    add_zero_rate(*state, *stack, mean, 0.003);
    expect_dense_update(*state, *stack, mean, 0.003, [](const State& s) { return s.core.b_gyro_rad_s; });
  });
}

TEST(Standing, GravityIsAMeasurementOfTiltAndAccelerometerBias) {
  const auto stack = std::make_unique<Stack>();
  test::for_all(30, [&](test::Generator& g) {
    const auto state = standing_state(g);
    const auto predict = [](const State& s) {
      const Vec3 right = s.core.motion.q_WI.conjugate() * Vec3(0.0, 0.0, 9.81) + s.core.b_accel_m_s2;
      return Vec3(right.cwiseQuotient(Vec3::Ones() + s.core.accel_scale));
    };
    const Vec3 mean = predict(*state) + g.normal_vector<3>(0.1);
    stack->begin(*state);
    add_gravity(*state, *stack, mean, 9.81, 0.05);
    expect_dense_update(*state, *stack, mean, 0.05, predict);
  });
}

// Standing still tells neither place nor heading.
TEST(Standing, LearnsNothingOfTheUnobservable) {
  const auto stack = std::make_unique<Stack>();
  test::for_all(30, [&](test::Generator& g) {
    const auto state = standing_state(g);
    const Dense directions = test::unobservable_directions(*state);
    const Dense before = dense(state->covariance());
    stack->begin(*state);
    add_gravity(*state, *stack, state->core.motion.q_WI.conjugate() * Vec3(0.0, 0.0, 9.81), 9.81, 0.05);
    ASSERT_EQ(add_zero_velocity(*state, *stack, 0.05), Status::kOk);
    add_zero_rate(*state, *stack, state->core.b_gyro_rad_s, 0.003);
    ASSERT_EQ(stack->apply(*state), Status::kOk);
    EXPECT_LT(test::false_information(before, dense(state->covariance()), directions), 1e-9);
  });
}

TEST(Standing, AVelocityBeyondDoubtIsNotOverruled) {
  const auto stack = std::make_unique<Stack>();
  test::for_all(30, [&](test::Generator& g) {
    const auto state = standing_state(g);
    state->core.motion.v_WI_m_s = 2.0 * g.direction();  // forty sigma of the prior
    stack->begin(*state);
    EXPECT_EQ(add_zero_velocity(*state, *stack, 0.01), Status::kRejected);
    EXPECT_EQ(stack->rows(), 0U);
  });
}

TEST(Standing, TheLevelAttitudePutsGravityUpAndTurnsNothingElse) {
  test::for_all(500, [](test::Generator& g) {
    const Vec3 accel = g.uniform(5.0, 15.0) * g.direction();
    const Quat q = level_attitude(accel);
    EXPECT_LT((q * accel.normalized() - Vec3::UnitZ()).norm(), 1e-12);
    EXPECT_NEAR(so3_log(q).z(), 0.0, 1e-7);  // no turn about the vertical
  });
}

}  // namespace
}  // namespace plumb
