#include "fsw/math/strapdown.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "test/support/property.h"

namespace plumb {
namespace {

constexpr double kGravity = 9.80665;  // m/s^2

KinematicState any_state(test::Generator& g) {
  return {so3_exp(g.uniform(0.0, 3.0) * g.direction()), g.normal_vector<3>(10.0), g.normal_vector<3>(3.0)};
}

InertialRates any_rates(test::Generator& g) { return {g.normal_vector<3>(1.0), g.normal_vector<3>(10.0)}; }

InertialRates between(const InertialRates& a, const InertialRates& b, double s) {
  return {a.gyro_rad_s + s * (b.gyro_rad_s - a.gyro_rad_s), a.accel_m_s2 + s * (b.accel_m_s2 - a.accel_m_s2)};
}

/// Largest of the errors in attitude [rad], position [m] and velocity [m/s].
double distance(const KinematicState& a, const KinematicState& b) {
  return std::max(
      {so3_log(a.q_WI.conjugate() * b.q_WI).norm(), (a.p_WI_m - b.p_WI_m).norm(), (a.v_WI_m_s - b.v_WI_m_s).norm()});
}

/// Rates that are linear in time over [0, length_s], taken in equal steps.
KinematicState fly(KinematicState state, const InertialRates& start, const InertialRates& end, double length_s,
                   int steps) {
  for (int k = 0; k < steps; ++k) {
    const double s0 = static_cast<double>(k) / steps;
    const double s1 = static_cast<double>(k + 1) / steps;
    strapdown_step(state, between(start, end, s0), between(start, end, s1), length_s / steps, kGravity);
  }
  return state;
}

/// Rates as a function of time [s] by classical Runge-Kutta on the rotation matrix, written independently, in very
/// small steps.
template <typename Rates>
KinematicState reference_flight(const KinematicState& from, const Rates& rates_at, double length_s) {
  constexpr int kSteps = 4000;
  struct Derivative {
    Mat3 r;
    Vec3 p, v;
  };
  Mat3 r = from.q_WI.toRotationMatrix();
  Vec3 p = from.p_WI_m;
  Vec3 v = from.v_WI_m_s;
  const Vec3 gravity(0.0, 0.0, -kGravity);
  const auto slope = [&](double t, const Mat3& at_r, const Vec3& at_v) {
    const InertialRates rates = rates_at(t);
    return Derivative{at_r * skew(rates.gyro_rad_s), at_v, at_r * rates.accel_m_s2 + gravity};
  };
  const double h = length_s / kSteps;
  for (int k = 0; k < kSteps; ++k) {
    const double t = k * h;
    const Derivative a = slope(t, r, v);
    const Derivative b = slope(t + 0.5 * h, r + 0.5 * h * a.r, v + 0.5 * h * a.v);
    const Derivative c = slope(t + 0.5 * h, r + 0.5 * h * b.r, v + 0.5 * h * b.v);
    const Derivative d = slope(t + h, r + h * c.r, v + h * c.v);
    r += h / 6.0 * (a.r + 2.0 * b.r + 2.0 * c.r + d.r);
    p += h / 6.0 * (a.p + 2.0 * b.p + 2.0 * c.p + d.p);
    v += h / 6.0 * (a.v + 2.0 * b.v + 2.0 * c.v + d.v);
  }
  return {Quat(r).normalized(), p, v};
}

/// A turn and a specific force that shake about all axes, out of step with each other: coning and sculling.
struct Shaking {
  Vec3 mean_gyro, swing_gyro[2], mean_accel, swing_accel[2];
  double frequency_rad_s;

  explicit Shaking(test::Generator& g)
      : mean_gyro(g.normal_vector<3>(0.3)),
        swing_gyro{g.normal_vector<3>(1.0), g.normal_vector<3>(1.0)},
        mean_accel(g.normal_vector<3>(10.0)),
        swing_accel{g.normal_vector<3>(5.0), g.normal_vector<3>(5.0)},
        frequency_rad_s(g.uniform(10.0, 20.0)) {}

  InertialRates operator()(double t) const {
    const double c = std::cos(frequency_rad_s * t);
    const double s = std::sin(frequency_rad_s * t);
    return {mean_gyro + c * swing_gyro[0] + s * swing_gyro[1], mean_accel + c * swing_accel[0] + s * swing_accel[1]};
  }
};

TEST(Strapdown, AtRestNothingMoves) {
  test::for_all(100, [](test::Generator& g) {
    KinematicState state = any_state(g);
    state.v_WI_m_s.setZero();
    const KinematicState before = state;
    const InertialRates rest{Vec3::Zero(), before.q_WI.conjugate() * Vec3(0.0, 0.0, kGravity)};
    for (int k = 0; k < 250; ++k) strapdown_step(state, rest, rest, 0.004, kGravity);
    EXPECT_LT(distance(state, before), 1e-12);
  });
}

TEST(Strapdown, ConstantAccelerationWithoutTurnIsExact) {
  test::for_all(200, [](test::Generator& g) {
    KinematicState state = any_state(g);
    const KinematicState before = state;
    const Vec3 acceleration = g.normal_vector<3>(5.0);
    const Vec3 force = before.q_WI.conjugate() * (acceleration + Vec3(0.0, 0.0, kGravity));
    const double t = g.uniform(0.001, 2.0);
    strapdown_step(state, {Vec3::Zero(), force}, {Vec3::Zero(), force}, t, kGravity);
    EXPECT_LT((state.v_WI_m_s - before.v_WI_m_s - acceleration * t).norm(), 1e-12);
    EXPECT_LT((state.p_WI_m - before.p_WI_m - before.v_WI_m_s * t - 0.5 * acceleration * t * t).norm(), 1e-12);
  });
}

// With constant rate w and specific force f in the body: R = R0 Exp(wt), v = v0 + R0 G1 f t + g t, and
// p = p0 + v0 t + R0 G2 f t^2 + g t^2 / 2, where G1 is the left Jacobian of wt and G2 its next integral.
TEST(Strapdown, ConstantRateAndBodyAccelerationMatchTheClosedForm) {
  test::for_all(200, [](test::Generator& g) {
    const KinematicState before = any_state(g);
    const InertialRates rates = any_rates(g);
    const double t = 1.0;
    const Vec3 turn = rates.gyro_rad_s * t;
    const double a = turn.norm();
    const Mat3 k = skew(turn);
    const Mat3 second = 0.5 * Mat3::Identity() + (a - std::sin(a)) / (a * a * a) * k +
                        (0.5 * a * a + std::cos(a) - 1.0) / (a * a * a * a) * k * k;
    const Mat3 r0 = before.q_WI.toRotationMatrix();
    const Vec3 gravity(0.0, 0.0, -kGravity);
    KinematicState expected;
    expected.q_WI = before.q_WI * so3_exp(turn);
    expected.v_WI_m_s = before.v_WI_m_s + r0 * so3_left_jacobian(turn) * rates.accel_m_s2 * t + gravity * t;
    expected.p_WI_m =
        before.p_WI_m + before.v_WI_m_s * t + r0 * second * rates.accel_m_s2 * t * t + 0.5 * gravity * t * t;
    const KinematicState state = fly(before, rates, rates, t, 250);
    EXPECT_LT(so3_log(state.q_WI.conjugate() * expected.q_WI).norm(), 1e-12);
    EXPECT_LT(distance(state, expected), 1e-7);
  });
}

TEST(Strapdown, OnRatesLinearInTimeConvergesWithTheFourthPowerOfTheStep) {
  double coarse = 0.0;
  double fine = 0.0;
  test::for_all(20, [&](test::Generator& g) {
    const KinematicState before = any_state(g);
    const InertialRates start = any_rates(g);
    const InertialRates end = any_rates(g);
    const KinematicState exact = reference_flight(before, [&](double t) { return between(start, end, t); }, 1.0);
    coarse += distance(fly(before, start, end, 1.0, 16), exact);
    fine += distance(fly(before, start, end, 1.0, 32), exact);
  });
  EXPECT_GT(fine, 1e-9);  // above the rounding of the reference, so the ratio means something
  EXPECT_GT(coarse / fine, 13.0);
  EXPECT_LT(coarse / fine, 19.0);
}

// Between two samples of any other motion a straight line is only a guess, and its error is of second order.
TEST(Strapdown, OnSampledMotionConvergesWithTheSquareOfTheSamplePeriod) {
  double coarse = 0.0;
  double fine = 0.0;
  double exact_between_samples = 0.0;
  test::for_all(20, [&](test::Generator& g) {
    const KinematicState before = any_state(g);
    const Shaking rates(g);
    const KinematicState exact = reference_flight(before, rates, 1.0);
    const auto error_of = [&](int samples, int steps_between) {
      KinematicState state = before;
      for (int k = 0; k < samples; ++k) {
        state = fly(state, rates(double(k) / samples), rates(double(k + 1) / samples), 1.0 / samples, steps_between);
      }
      return distance(state, exact);
    };
    coarse += error_of(100, 1);
    fine += error_of(200, 1);
    exact_between_samples += error_of(200, 20);
  });
  EXPECT_GT(coarse / fine, 3.6);
  EXPECT_LT(coarse / fine, 4.4);
  // What is lost is lost between the samples: following the straight line exactly gains nothing.
  EXPECT_NEAR(exact_between_samples / fine, 1.0, 0.02);
}

TEST(Strapdown, BackwardUndoesForward) {
  test::for_all(500, [](test::Generator& g) {
    const KinematicState before = any_state(g);
    const InertialRates start = any_rates(g);
    const InertialRates end = any_rates(g);
    const double dt = g.uniform(0.0005, 0.008);
    KinematicState state = before;
    strapdown_step(state, start, end, dt, kGravity);
    EXPECT_GT(distance(state, before), 1e-6);
    strapdown_step(state, end, start, -dt, kGravity);
    EXPECT_LT(so3_log(state.q_WI.conjugate() * before.q_WI).norm(), 1e-14);
    EXPECT_LT(distance(state, before), 1e-8);
  });
}

TEST(Strapdown, TheQuaternionStaysUnit) {
  test::for_all(5, [](test::Generator& g) {
    KinematicState state = any_state(g);
    for (int k = 0; k < 20000; ++k) {
      strapdown_step(state, any_rates(g), any_rates(g), 0.004, kGravity);
      ASSERT_NEAR(state.q_WI.norm(), 1.0, 1e-15 * 4.0);
    }
  });
}

// The axis goes round a cone, sampled 31 times a turn: what a plain integration of the rate loses is the cone's solid
// angle. The rate is linear between samples, and its exact integral is had from steps fifty times as fine.
TEST(Strapdown, FollowsConing) {
  constexpr double kPeriod_s = 0.004;
  constexpr double kCone = 2.0 * std::numbers::pi * 8.0;  // rad/s
  const auto rates = [](double t) {
    return InertialRates{Vec3(3.0 * std::cos(kCone * t), 3.0 * std::sin(kCone * t), 0.0), Vec3(0.0, 0.0, kGravity)};
  };
  KinematicState state;
  KinematicState exact;
  Quat plain = Quat::Identity();
  for (int k = 0; k < 2500; ++k) {
    const InertialRates start = rates(k * kPeriod_s);
    const InertialRates end = rates((k + 1) * kPeriod_s);
    strapdown_step(state, start, end, kPeriod_s, kGravity);
    exact = fly(exact, start, end, kPeriod_s, 50);
    plain = plain * so3_exp(0.5 * (start.gyro_rad_s + end.gyro_rad_s) * kPeriod_s);
  }
  const double lost = so3_log(exact.q_WI.conjugate() * plain).norm();
  EXPECT_GT(lost, 1e-3);
  EXPECT_LT(so3_log(exact.q_WI.conjugate() * state.q_WI).norm(), 0.01 * lost);
}

}  // namespace
}  // namespace plumb
