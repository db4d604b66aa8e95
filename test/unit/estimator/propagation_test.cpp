#include "fsw/estimator/propagation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <vector>

#include "test/support/estimator_cases.h"

namespace plumb {
namespace {

using test::Vec15;

constexpr double kPeriod_s = 0.004;

InertialRates between(const InertialRates& a, const InertialRates& b, double s) {
  return {a.gyro_rad_s + s * (b.gyro_rad_s - a.gyro_rad_s), a.accel_m_s2 + s * (b.accel_m_s2 - a.accel_m_s2)};
}

/// A stretch of lively flight, linear between the samples.
std::vector<ImuInterval> any_flight(test::Generator& g, int samples) {
  std::vector<ImuInterval> out;
  InertialRates now{g.normal_vector<3>(0.5), Vec3(0.0, 0.0, 9.8) + g.normal_vector<3>(2.0)};
  for (int k = 0; k < samples; ++k) {
    const InertialRates next{now.gyro_rad_s + g.normal_vector<3>(0.1), now.accel_m_s2 + g.normal_vector<3>(0.5)};
    out.push_back({now, next, kPeriod_s, kPeriod_s});
    now = next;
  }
  return out;
}

/// The same flight with every interval cut into equal parts.
std::vector<ImuInterval> subdivided(const std::vector<ImuInterval>& flight, int parts) {
  std::vector<ImuInterval> out;
  for (const ImuInterval& i : flight) {
    for (int k = 0; k < parts; ++k) {
      const double a = static_cast<double>(k) / parts;
      const double b = static_cast<double>(k + 1) / parts;
      out.push_back({between(i.start, i.end, a), between(i.start, i.end, b), i.dt_s / parts, i.period_s});
    }
  }
  return out;
}

CoreState any_core(test::Generator& g) {
  CoreState core = test::core_over_ground(g, static_cast<std::size_t>(g.integer(0, 100)));
  core.motion.q_WI = test::any_attitude(g);
  return core;
}

CoreTransition propagate(CoreState& core, const std::vector<ImuInterval>& flight, const ImuOptions& options) {
  CoreTransition transition;
  for (const ImuInterval& i : flight) propagate_step(core, transition, i, options);
  return transition;
}

/// The nominal state alone.
void fly(CoreState& core, const ImuInterval& i, const ImuOptions& options) {
  strapdown_step(core.motion, {i.start.gyro_rad_s - core.b_gyro_rad_s, i.start.accel_m_s2 - core.b_accel_m_s2},
                 {i.end.gyro_rad_s - core.b_gyro_rad_s, i.end.accel_m_s2 - core.b_accel_m_s2}, i.dt_s,
                 options.gravity_m_s2);
}

/// The right-invariant error of `truth` against `estimate`, to first order.
Vec15 error_of(const CoreState& truth, const CoreState& estimate) {
  const Quat dq = truth.motion.q_WI * estimate.motion.q_WI.conjugate();
  Vec15 e;
  e << so3_log(dq), truth.motion.p_WI_m - dq * estimate.motion.p_WI_m,
      truth.motion.v_WI_m_s - dq * estimate.motion.v_WI_m_s, truth.b_gyro_rad_s - estimate.b_gyro_rad_s,
      truth.b_accel_m_s2 - estimate.b_accel_m_s2;
  return e;
}

Mat15 numeric_transition(const CoreState& core, const std::vector<ImuInterval>& flight, const ImuOptions& options) {
  CoreState nominal = core;
  propagate(nominal, flight, options);
  return test::numeric_jacobian<15, 15>(
      [&](const Vec15& e) {
        CoreState truth = core;
        retract_core(truth, e.data());
        for (const ImuInterval& i : flight) fly(truth, i, options);
        return error_of(truth, nominal);
      },
      1e-5);
}

TEST(Propagation, TheStateIsTheStrapdownOfUnbiasedRates) {
  test::for_all(100, [](test::Generator& g) {
    CoreState core = any_core(g);
    CoreState expected = core;
    const ImuOptions options;
    const auto flight = any_flight(g, 5);
    propagate(core, flight, options);
    for (const ImuInterval& i : flight) fly(expected, i, options);
    EXPECT_EQ(core.motion.p_WI_m, expected.motion.p_WI_m);
    EXPECT_EQ(core.motion.v_WI_m_s, expected.motion.v_WI_m_s);
    EXPECT_EQ(core.motion.q_WI.coeffs(), expected.motion.q_WI.coeffs());
    EXPECT_EQ(core.b_gyro_rad_s, expected.b_gyro_rad_s);
    EXPECT_EQ(core.b_accel_m_s2, expected.b_accel_m_s2);
  });
}

TEST(Propagation, TheTransitionIsTheDerivativeOfTheFlight) {
  test::for_all(60, [](test::Generator& g) {
    const CoreState core = any_core(g);
    const ImuOptions options;
    const auto flight = any_flight(g, 8);  // one image interval
    CoreState end = core;
    const Mat15 phi = propagate(end, flight, options).phi;
    const Mat15 numeric = numeric_transition(core, flight, options);
    // Position enters the gyro-bias column with its distance from the world's origin: measure against its size.
    for (int c = 0; c < 15; ++c) {
      EXPECT_LT((phi.col(c) - numeric.col(c)).norm(), 1e-4 * numeric.col(c).norm()) << "column " << c;
    }
  });
}

// The linearisation point is held over a step, at its middle: of second order over a flight.
TEST(Propagation, TheTransitionConvergesWithTheStep) {
  double coarse = 0.0;
  double fine = 0.0;
  test::for_all(20, [&](test::Generator& g) {
    const CoreState core = any_core(g);
    const ImuOptions options;
    const std::vector<ImuInterval> flight = {{any_flight(g, 1)[0].start, any_flight(g, 1)[0].end, 0.04}};
    const Mat15 numeric = numeric_transition(core, subdivided(flight, 16), options);
    const auto error = [&](int parts) {
      CoreState end = core;
      return (propagate(end, subdivided(flight, parts), options).phi - numeric).norm();
    };
    coarse += error(2);
    fine += error(4);
  });
  EXPECT_GT(coarse / fine, 3.3);
}

TEST(Propagation, TheErrorDynamicsAreNilpotent) {
  test::for_all(100, [](test::Generator& g) {
    const Mat15 f = error_dynamics(any_core(g).motion, 9.8);
    const Mat15 f3 = f * f * f;
    EXPECT_GT(f3.norm(), 1.0);
    EXPECT_EQ(Mat15(f3 * f).norm(), 0.0);
  });
}

// What no sensor observes stays what it was, exactly, at every estimate: no false heading information.
TEST(Propagation, UnobservableDirectionsAreConstant) {
  test::for_all(100, [](test::Generator& g) {
    CoreState core = any_core(g);
    const Mat15 phi = propagate(core, any_flight(g, 10), ImuOptions{}).phi;
    Eigen::Matrix<double, 15, 4> n = Eigen::Matrix<double, 15, 4>::Zero();
    n.block<3, 3>(static_cast<Eigen::Index>(kXiP), 0).setIdentity();
    n(static_cast<Eigen::Index>(kTheta) + 2, 3) = 1.0;
    EXPECT_EQ(phi * n, n);
    EXPECT_EQ(phi.bottomRows<6>(), Mat15::Identity().bottomRows<6>());  // biases do not depend on motion
  });
}

TEST(Propagation, NoiseIsSymmetricAndPositive) {
  test::for_all(100, [](test::Generator& g) {
    CoreState core = any_core(g);
    const Mat15 q = propagate(core, any_flight(g, 8), ImuOptions{}).q;
    EXPECT_LT((q - q.transpose()).cwiseAbs().maxCoeff(), 1e-15 * q.norm());
    const Eigen::VectorXd scale = q.diagonal().cwiseSqrt().cwiseInverse();
    const Mat15 normalised = scale.asDiagonal() * (0.5 * (q + q.transpose())) * scale.asDiagonal();
    EXPECT_GT(test::smallest_eigenvalue(normalised), -1e-9);
  });
}

/// White noise and bias walk by superposition: the effect at the end of the flight of one sigma of noise in each fine
/// step and axis, found by flying with it, squared and summed. A Monte Carlo without chance.
Mat15 superposed_noise(const CoreState& core, const std::vector<ImuInterval>& fine, const ImuOptions& options) {
  CoreState nominal = core;
  propagate(nominal, fine, options);
  Mat15 q = Mat15::Zero();
  for (std::size_t hit = 0; hit < fine.size(); ++hit) {
    for (int kind = 0; kind < 12; ++kind) {
      const double dt = fine[hit].dt_s;
      const Vec3 rate_rad_s = between(fine[hit].start, fine[hit].end, 0.5).gyro_rad_s - core.b_gyro_rad_s;
      constexpr double kTurnTime_s = 1.0;  // errors of scale count as much as white noise that adds up for so long
      const double scale_density = options.gyro_scale_error * rate_rad_s.norm() * std::sqrt(kTurnTime_s);
      const double gyro_density = std::hypot(options.gyro_noise_density, scale_density);
      const double sigma[] = {gyro_density / std::sqrt(dt), options.accel_noise_density / std::sqrt(dt),
                              options.gyro_bias_walk * std::sqrt(dt), options.accel_bias_walk * std::sqrt(dt)};
      const Vec3 noise = sigma[kind / 3] * Vec3::Unit(kind % 3);
      CoreState truth = core;
      for (std::size_t k = 0; k < fine.size(); ++k) {
        ImuInterval i = fine[k];
        if (k == hit && kind < 6) {  // the sensor reads this much too low, so the truth moves by more
          Vec3 InertialRates::* sensor = kind < 3 ? &InertialRates::gyro_rad_s : &InertialRates::accel_m_s2;
          i.start.*sensor += noise;
          i.end.*sensor += noise;
        }
        if (k == hit && kind >= 6) (kind < 9 ? truth.b_gyro_rad_s : truth.b_accel_m_s2) += noise;
        fly(truth, i, options);
      }
      const Vec15 e = error_of(truth, nominal);
      q += e * e.transpose();
    }
  }
  return q;
}

TEST(Propagation, NoiseIsWhatTheSensorsInject) {
  test::for_all(6, [](test::Generator& g) {
    const CoreState core = any_core(g);
    ImuOptions options;
    options.gyro_scale_error = g.uniform(0.0, 1e-3);
    const auto flight = any_flight(g, 8);
    CoreState end = core;
    const Mat15 q = propagate(end, flight, options).q;
    const Mat15 reference = superposed_noise(core, subdivided(flight, 6), options);
    const Eigen::VectorXd scale = reference.diagonal().cwiseSqrt().cwiseInverse();
    EXPECT_LT((scale.asDiagonal() * (q - reference) * scale.asDiagonal()).cwiseAbs().maxCoeff(), 0.05);
  });
}

TEST(Propagation, WhereAnIntervalIsSplitDoesNotMatter) {
  test::for_all(200, [](test::Generator& g) {
    const CoreState core = any_core(g);
    const ImuOptions options;
    auto flight = any_flight(g, 4);
    CoreState whole = core;
    const CoreTransition once = propagate(whole, flight, options);
    const double s = g.uniform(0.001, 0.999);
    const ImuInterval i = flight[1];
    flight[1] = {i.start, between(i.start, i.end, s), s * i.dt_s, i.period_s};
    flight.insert(flight.begin() + 2, {between(i.start, i.end, s), i.end, (1.0 - s) * i.dt_s, i.period_s});
    CoreState parts = core;
    const CoreTransition split = propagate(parts, flight, options);
    EXPECT_LT(so3_log(parts.motion.q_WI.conjugate() * whole.motion.q_WI).norm(), 1e-10);
    EXPECT_LT((parts.motion.p_WI_m - whole.motion.p_WI_m).norm(), 1e-9);
    EXPECT_LT((parts.motion.v_WI_m_s - whole.motion.v_WI_m_s).norm(), 1e-9);
    const Mat15 p = test::any_covariance(g, 15);
    const Mat15 p_once = test::congruent(once.phi, p) + once.q;
    const Mat15 p_split = test::congruent(split.phi, p) + split.q;
    EXPECT_LT((p_once - p_split).norm(), 1e-5 * p_once.norm());
    EXPECT_LT((once.q - split.q).norm(), 0.02 * once.q.norm());
  });
}

/// One buffer interval of `period_s` between others of the usual length, walked from image to image.
Mat15 noise_over_a_hole(const CoreState& core, double period_s, std::int64_t images) {
  ImuBuffer imu;
  const Time begin = Time::from_ns(1'000'000'000);
  ImuSample sample;
  sample.accel_m_s2 = {0.0, 0.0, 9.8};
  for (const double t_s : {0.0, 0.004, 0.004 + period_s, 0.008 + period_s}) {
    sample.t = begin + Duration::from_seconds(t_s);
    EXPECT_EQ(imu.push(sample), Status::kOk);
  }
  CoreState flown = core;
  CoreTransition transition;
  Time t = begin;
  for (std::int64_t k = 1; k <= images; ++k) {
    const Time end = k == images ? imu.newest() : begin + (imu.newest() - begin) * k / images;
    imu.for_each_interval(t, end, [&](const ImuInterval& i) { propagate_step(flown, transition, i, ImuOptions{}); });
    t = end;
  }
  return transition.q;
}

double sigma_of(const Mat15& q, std::size_t at) {
  const auto i = static_cast<Eigen::Index>(at);
  return std::sqrt(q(i, i));
}

// A knock leaves velocity and position related by when it came, which nobody knows. Were they taken to be in
// proportion, the first image after the hole would seem to tell the velocity.
TEST(Propagation, AHoleCostsWhatTheRatesMayHaveBeenWhereverImagesCutIt) {
  CoreState level;
  level.motion.v_WI_m_s = Vec3(2.0, 0.0, 0.0);
  const double usual_m_s = sigma_of(noise_over_a_hole(level, 0.01, 1), kXiV);
  test::for_all(50, [&](test::Generator& g) {
    const double period_s = g.uniform(0.02, 0.12);
    const Mat15 q = noise_over_a_hole(level, period_s, 1);
    constexpr double kUnseenAccel_m_s2 = 20.0;
    EXPECT_NEAR(sigma_of(q, kXiV), kUnseenAccel_m_s2 * (period_s - 0.01), 0.02 * kUnseenAccel_m_s2 * period_s);
    EXPECT_NEAR(sigma_of(q, kTheta), 1.0 * (period_s - 0.01), 0.02 * period_s);
    EXPECT_LT(10.0 * usual_m_s, sigma_of(q, kXiV));
    const double together = q(kXiP, kXiV) / (sigma_of(q, kXiP) * sigma_of(q, kXiV));
    EXPECT_LT(together, 0.93);
    const Mat15 cut = noise_over_a_hole(level, period_s, g.integer(2, 9));
    EXPECT_LT((q - cut).norm(), 0.02 * q.norm());
  });
}

TEST(Propagation, AReadingAtTheEndOfItsScaleCostsTheSameAtAnyRate) {
  const ImuOptions options;
  const auto noise = [&](double accel_m_s2, double gyro_rad_s, double period_s) {
    const InertialRates read{{gyro_rad_s, 0.0, 0.0}, {0.0, -accel_m_s2, 0.0}};
    CoreState core;
    CoreTransition transition;
    constexpr double kSpan_s = 0.02;
    const int steps = static_cast<int>(std::lround(kSpan_s / period_s));
    for (int k = 0; k < steps; ++k) propagate_step(core, transition, {read, read, period_s, period_s}, options);
    return transition.q;
  };
  const double limit_m_s2 = options.max_accel_m_s2;
  EXPECT_LT(sigma_of(noise(0.95 * limit_m_s2, 0.0, 0.004), kXiV), 0.01);
  for (const double period_s : {0.0005, 0.004}) {
    EXPECT_NEAR(sigma_of(noise(0.99 * limit_m_s2, 0.0, period_s), kXiV), 0.25 * limit_m_s2 * 0.02, 0.05);
    EXPECT_NEAR(sigma_of(noise(0.0, 0.99 * options.max_gyro_rad_s, period_s), kTheta),
                0.25 * options.max_gyro_rad_s * 0.02, 0.01);
  }
}

TEST(Propagation, RetractionsOfAPoseAddUpAlongOneDirection) {
  test::for_all(200, [](test::Generator& g) {
    const test::Vec6 e = g.normal_vector<6>(0.5);
    Quat q_half = test::any_attitude(g);
    Vec3 p_half = g.normal_vector<3>(5.0);
    Quat q_once = q_half;
    Vec3 p_once = p_half;
    retract_pose(e.head<3>(), e.tail<3>(), q_once, p_once);
    for (int k = 0; k < 2; ++k) retract_pose(0.5 * e.head<3>(), 0.5 * e.tail<3>(), q_half, p_half);
    EXPECT_LT(so3_log(q_once.conjugate() * q_half).norm(), 1e-13);
    EXPECT_LT((p_once - p_half).norm(), 1e-12);
  });
}

}  // namespace
}  // namespace plumb
