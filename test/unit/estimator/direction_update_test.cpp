#include "fsw/estimator/direction_update.h"

#include <gtest/gtest.h>

#include <limits>
#include <memory>
#include <numbers>

#include "test/support/dense_filter.h"

namespace plumb {
namespace {

using test::Dense;
using test::dense;
using test::TinyConfig;
using State = FilterState<TinyConfig>;
using Stack = UpdateStack<TinyConfig>;
using Update = DirectionUpdate<TinyConfig>;

constexpr DirectionOptions kOptions{.sun_noise_rad = 0.01, .magnetometer_noise_rad = 0.03, .gate_probability = 0.999};
const Vec3 kSun = Vec3(0.3, -0.5, 0.8).normalized();
const Vec3 kField = Vec3(0.1, 0.5, -0.8).normalized();

Time at(double t_s) { return Time::from_seconds(t_s); }

DirectionSample sample_of(DirectionSource source, double t_s, const Vec3& seen_I, const Vec3& known) {
  DirectionSample sample{.t = at(t_s), .source = source};
  std::copy_n(seen_I.data(), 3, sample.seen_I.begin());
  std::copy_n(known.data(), 3, sample.known_W.begin());
  return sample;
}

/// A filter at 100 s, its IMU, and all that an update needs.
struct Filter {
  explicit Filter(test::Generator& g) {
    test::fill_state(g, test::nadir_calibration(), 3, *state);
    state->core.b_gyro_rad_s.setZero();
    for (int k = 0; k < 200; ++k) static_cast<void>(imu.push({.t = at(99.5 + 0.005 * k)}));
  }

  Result<bool> fuse(Update& update, double t_s = 100.0) {
    return update.fuse(*state, *stack, imu, at(t_s), report, counters);
  }
  /// Has the heading known, of a world that is right already; nothing is pending afterwards.
  void make_heading_known(Update& update) {
    const State before = *state;
    for (const double t_s : {99.97, 99.98, 99.99}) {
      ASSERT_EQ(
          update.add(sample_of(DirectionSource::kSun, t_s, state->core.motion.q_WI.conjugate() * kSun, kSun), counters),
          Status::kOk);
      ASSERT_TRUE(fuse(update).has_value());
    }
    ASSERT_TRUE(update.heading_known());
    *state = before;
    counters = {};
    report = {};
  }

  std::unique_ptr<State> state = std::make_unique<State>();
  std::unique_ptr<Stack> stack = std::make_unique<Stack>();
  ImuBuffer imu;
  FrameReport report;
  EstimatorCounters counters;
};

/// Near enough for the first order.
Quat nearly(test::Generator& g, const Quat& q) { return (so3_exp(g.normal_vector<3>(1e-6)) * q).normalized(); }

/// The sample must do to the filter what the rows r = h dx + n, n of `sigma_rad`, do.
void expect_dense_update(Filter& f, Update& update, const DirectionSample& sample, const Dense& h,
                         const Eigen::VectorXd& r, double sigma_rad) {
  const auto expected =
      test::dense_update(dense(f.state->covariance()), {h, r, Eigen::VectorXd::Constant(r.size(), sigma_rad)});
  State moved = *f.state;
  moved.retract(expected.dx.data());
  ASSERT_EQ(update.add(sample, f.counters), Status::kOk);
  ASSERT_TRUE(f.fuse(update).has_value());
  EXPECT_EQ(f.report.directions_used, 1U);
  test::expect_same_nominal(*f.state, moved, 1e-8);
  EXPECT_LT(test::covariance_difference(expected.p, dense(f.state->covariance())), 1e-5);
}

TEST(DirectionUpdate, TheSunIsAMeasurementOfBothAngles) {
  test::for_all(30, [](test::Generator& g) {
    Filter f(g);
    Update update(kOptions);
    f.make_heading_known(update);
    const Vec3 seen_I = nearly(g, f.state->core.motion.q_WI).conjugate() * kSun;
    const Vec3 east = Vec3(-kSun.y(), kSun.x(), 0.0).normalized();
    const Vec3 right_I = f.state->core.motion.q_WI.conjugate() * east;
    const Vec3 up_I = f.state->core.motion.q_WI.conjugate() * kSun.cross(east);
    const auto across = [&](const Vec3& sun_I) { return Vec2(right_I.dot(sun_I), up_I.dot(sun_I)); };
    const auto predict = [&](const State& s) { return across(s.core.motion.q_WI.conjugate() * kSun); };
    const Dense h = test::numeric_state_jacobian(*f.state, 2, predict);
    const Eigen::VectorXd r = across(seen_I) - predict(*f.state);
    expect_dense_update(f, update, sample_of(DirectionSource::kSun, 100.0, seen_I, kSun), h, r, kOptions.sun_noise_rad);
  });
}

TEST(DirectionUpdate, TheFieldIsAMeasurementOfItsAzimuthAlone) {
  test::for_all(30, [](test::Generator& g) {
    Filter f(g);
    Update update(kOptions);
    f.make_heading_known(update);
    const Vec3 seen_I = nearly(g, f.state->core.motion.q_WI).conjugate() * kField;
    const auto predict = [&](const State& s) {
      const Vec3 field_W = s.core.motion.q_WI * seen_I;
      return Eigen::Matrix<double, 1, 1>(std::atan2(field_W.y(), field_W.x()));
    };
    const Dense h = test::numeric_state_jacobian(*f.state, 1, predict);
    const Eigen::VectorXd r = Eigen::Matrix<double, 1, 1>(std::atan2(kField.y(), kField.x())) - predict(*f.state);
    const double sigma_rad = kOptions.magnetometer_noise_rad / kField.head<2>().norm();
    expect_dense_update(f, update, sample_of(DirectionSource::kMagnetometer, 100.0, seen_I, kField), h, r, sigma_rad);
  });
}

// A vehicle that turns between the direction and the image: the gyro carries it over.
TEST(DirectionUpdate, TheGyroCarriesADirectionToTheImage) {
  test::for_all(20, [](test::Generator& g) {
    Filter f(g);
    Update update(kOptions);
    f.make_heading_known(update);
    const Vec3 rate = g.normal_vector<3>(1.0);
    f.imu.clear();
    for (int k = 0; k < 200; ++k) {
      static_cast<void>(f.imu.push({.t = at(99.5 + 0.005 * k), .gyro_rad_s = {rate.x(), rate.y(), rate.z()}}));
    }
    const Quat then = f.state->core.motion.q_WI * so3_exp(rate * -0.05);
    ASSERT_EQ(update.add(sample_of(DirectionSource::kSun, 99.95 + 0.045, Vec3::UnitX(), kSun), f.counters),
              Status::kOk);
    ASSERT_EQ(
        update.add(sample_of(DirectionSource::kMagnetometer, 99.95, then.conjugate() * kField, kField), f.counters),
        Status::kOk);
    const Quat before = f.state->core.motion.q_WI;
    ASSERT_TRUE(f.fuse(update).has_value());
    EXPECT_EQ(f.counters.directions_gated, 1U);  // the sun, which is nowhere near
    EXPECT_EQ(f.counters.directions_used, 1U);
    EXPECT_LT(so3_log(before.conjugate() * f.state->core.motion.q_WI).norm(), 1e-9);
  });
}

TEST(DirectionUpdate, DirectionsThatAgreeTurnTheWorld) {
  test::for_all(30, [](test::Generator& g) {
    Filter f(g);
    Update update(kOptions);
    const double heading_rad = g.uniform(-std::numbers::pi, std::numbers::pi);
    const Quat right = so3_exp(Vec3(0.0, 0.0, heading_rad)) * f.state->core.motion.q_WI;
    const auto see = [&](double t_s, const Vec3& seen_I) {
      EXPECT_EQ(update.add(sample_of(DirectionSource::kMagnetometer, t_s, seen_I, kField), f.counters), Status::kOk);
      const Result<bool> turned = f.fuse(update);
      EXPECT_TRUE(turned.has_value());
      return *turned;
    };
    EXPECT_FALSE(see(99.95, so3_exp(Vec3(0.0, 0.0, 1.0)) * (right.conjugate() * kField)));  // a lorry drives past
    EXPECT_FALSE(see(99.96, right.conjugate() * kField));
    EXPECT_FALSE(see(99.97, right.conjugate() * kField));
    EXPECT_FALSE(update.heading_known());
    EXPECT_TRUE(see(99.98, right.conjugate() * kField));
    EXPECT_TRUE(f.report.heading_known);
    EXPECT_LT(so3_log(right.conjugate() * f.state->core.motion.q_WI).norm(), 1e-9);
    // As sure as one direction is, and what tilt is known of.
    const double sigma_rad = kOptions.magnetometer_noise_rad / kField.head<2>().norm();
    const double heading_sigma_rad = std::sqrt(f.state->covariance()(kTheta + 2, kTheta + 2));
    EXPECT_NEAR(heading_sigma_rad, sigma_rad, 0.5 * sigma_rad);
    EXPECT_FALSE(see(99.99, right.conjugate() * kField));
  });
}

TEST(DirectionUpdate, BadDirectionsAreCountedAndDropped) {
  test::Generator g(1);
  Filter f(g);
  Update update(kOptions);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const Vec3& bad : {Vec3(0.0, 0.0, 0.0), Vec3(nan, 0.0, 1.0), Vec3(1.0 / 0.0, 0.0, 1.0)}) {
    EXPECT_EQ(update.add(sample_of(DirectionSource::kSun, 99.9, bad, kSun), f.counters), Status::kInvalidValue);
    EXPECT_EQ(update.add(sample_of(DirectionSource::kSun, 99.9, kSun, bad), f.counters), Status::kInvalidValue);
  }
  EXPECT_EQ(update.add(sample_of(static_cast<DirectionSource>(2), 99.9, kSun, kSun), f.counters),
            Status::kInvalidValue);
  EXPECT_EQ(update.add(sample_of(DirectionSource::kSun, 99.9, kSun, kSun), f.counters), Status::kOk);
  EXPECT_EQ(update.add(sample_of(DirectionSource::kSun, 99.9, kSun, kSun), f.counters), Status::kOutOfOrder);
  EXPECT_EQ(f.counters.directions, 9U);
  EXPECT_EQ(f.counters.directions_invalid, 8U);
}

TEST(DirectionUpdate, EveryDirectionIsFiledOnce) {
  test::for_all(20, [](test::Generator& g) {
    Filter f(g);
    Update update(kOptions);
    std::uint64_t offered = 0;
    double t_s = 99.6;
    for (int image = 0; image < 10; ++image) {
      for (std::int64_t k = g.integer(0, 6); k > 0; --k) {
        t_s += g.uniform(0.0005, 0.01);
        const auto source = g.integer(0, 1) == 0 ? DirectionSource::kSun : DirectionSource::kMagnetometer;
        const Vec3 seen_I = g.integer(0, 3) == 0 ? g.direction() : f.state->core.motion.q_WI.conjugate() * kSun;
        ASSERT_EQ(update.add(sample_of(source, t_s, seen_I, kSun), f.counters), Status::kOk);
        ++offered;
      }
      ASSERT_TRUE(f.fuse(update, t_s).has_value());
    }
    const EstimatorCounters& c = f.counters;
    EXPECT_EQ(c.directions, offered);
    EXPECT_EQ(c.directions_used + c.directions_gated + c.directions_spare + c.directions_invalid, offered);
  });
}

TEST(DirectionUpdate, NothingIsUsedOfASensorThatIsOff) {
  test::Generator g(1);
  Filter f(g);
  Update update({});
  for (int k = 0; k < 5; ++k) {
    EXPECT_EQ(update.add(sample_of(DirectionSource::kSun, 99.9 + 0.01 * k, kSun, kSun), f.counters), Status::kOk);
    EXPECT_FALSE(*f.fuse(update));
  }
  EXPECT_FALSE(update.heading_known());
  EXPECT_EQ(f.counters.directions_used, 0U);
}

}  // namespace
}  // namespace plumb
