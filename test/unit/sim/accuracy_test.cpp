// The judge must be right before it judges: known errors go in, the same figures must come out.

#include "test/support/sim/accuracy.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "test/support/property.h"

namespace plumb::sim {
namespace {

constexpr double kSigmaPosition_m = 0.2;
constexpr double kSigmaVelocity_m_s = 0.05;
constexpr double kSigmaAttitude_rad = 0.01;

/// An estimate with this error (truth minus estimate, attitude local), in a world turned and shifted against the truth.
NavState estimate_with(const TruthState& truth, const NavError& error, double turn_rad, const Vec3& shift_m) {
  const Quat turn(Eigen::AngleAxisd(turn_rad, Vec3::UnitZ()));
  const Vec3 p = turn * truth.p_WI_m + shift_m - error.position_m;
  const Vec3 v = turn * truth.v_WI_m_s - error.velocity_m_s;
  const Quat q = turn * truth.q_WI * so3_exp(-error.attitude_rad);
  NavState state;
  state.valid = true;
  for (int axis = 0; axis < 3; ++axis) {
    state.p_WI_m[axis] = p[axis];
    state.v_WI_m_s[axis] = v[axis];
    const double sigmas[] = {kSigmaPosition_m, kSigmaVelocity_m_s, kSigmaAttitude_rad};
    for (int part = 0; part < 3; ++part) {
      const int i = 3 * part + axis;
      state.covariance[i * kNavErrorSize + i] = sigmas[part] * sigmas[part];
    }
  }
  state.q_WI = {q.w(), q.x(), q.y(), q.z()};
  return state;
}

/// A flight of known errors; the first point has none, because that is where the alignment is taken.
template <typename ErrorAt>
FlightLog flight_with(ErrorAt error_at, double scale = 1.0) {
  const Trajectory trajectory = outdoor_cruise(Vec3(0.0, 0.0, 0.3));
  FlightLog log;
  log.length_s = trajectory.length_s();
  log.cruise_start_s = trajectory.cruise_start_s();
  log.cruise_end_s = trajectory.cruise_end_s();
  for (int k = 0; k <= 750; ++k) {
    FlightPoint point;
    point.t_s = 0.1 * k;
    point.truth = trajectory.at(point.t_s);
    TruthState scaled = point.truth;
    scaled.p_WI_m *= scale;
    scaled.v_WI_m_s *= scale;
    point.estimate = estimate_with(scaled, k == 0 ? NavError{} : error_at(k), 0.7, Vec3(3.0, -2.0, 1.0));
    log.points.push_back(point);
  }
  return log;
}

TEST(Accuracy, PerfectEstimateInAnotherWorldHasNoError) {
  const Accuracy accuracy = evaluate(flight_with([](int) { return NavError{}; }));
  EXPECT_TRUE(accuracy.started);
  EXPECT_FALSE(accuracy.diverged);
  EXPECT_EQ(accuracy.coverage_percent, 100.0);
  EXPECT_NEAR(accuracy.position_rmse_m, 0.0, 1e-9);
  EXPECT_NEAR(accuracy.velocity_rmse_m_s, 0.0, 1e-9);
  EXPECT_NEAR(accuracy.attitude_rmse_deg, 0.0, 1e-6);
  EXPECT_NEAR(accuracy.cruise_scale_percent, 0.0, 1e-9);
  EXPECT_NEAR(accuracy.sim3_scale_percent, 0.0, 1e-9);
}

TEST(Accuracy, ConstantErrorsComeOutAsPutIn) {
  const NavError error{Vec3(0.3, 0.0, -0.4), Vec3(0.0, 0.1, 0.0), Vec3(0.0, 0.0, 0.02)};
  const Accuracy accuracy = evaluate(flight_with([&](int) { return error; }));
  EXPECT_NEAR(accuracy.position_final_m, 0.5, 1e-9);
  EXPECT_NEAR(accuracy.position_rmse_m, 0.5, 1e-3);
  EXPECT_NEAR(accuracy.velocity_rmse_m_s, 0.1, 1e-3);
  EXPECT_NEAR(accuracy.yaw_final_deg, 0.02 * 180.0 / std::numbers::pi, 1e-9);
  EXPECT_NEAR(accuracy.worst_axis_percent, 100.0 * 0.4 / accuracy.distance_m, 1e-9);
  EXPECT_NEAR(accuracy.nees.back().position, (0.09 + 0.16) / (kSigmaPosition_m * kSigmaPosition_m), 1e-9);
  EXPECT_NEAR(accuracy.nees.back().velocity, 0.01 / (kSigmaVelocity_m_s * kSigmaVelocity_m_s), 1e-9);
  EXPECT_NEAR(accuracy.nees.back().attitude, 4e-4 / (kSigmaAttitude_rad * kSigmaAttitude_rad), 1e-6);
}

TEST(Accuracy, ScaleErrorIsSeenByBothMeasures) {
  const Accuracy accuracy = evaluate(flight_with([](int) { return NavError{}; }, 1.02));
  EXPECT_NEAR(accuracy.cruise_scale_percent, 2.0, 1e-6);
  EXPECT_NEAR(accuracy.sim3_scale_percent, 2.0, 1e-6);
}

TEST(Accuracy, TrueCovarianceGivesNeesOfItsDegreesOfFreedom) {
  test::for_all(3, [](test::Generator& g) {
    const Accuracy accuracy = evaluate(flight_with([&](int) {
      return NavError{g.normal_vector<3>(kSigmaPosition_m), g.normal_vector<3>(kSigmaVelocity_m_s),
                      g.normal_vector<3>(kSigmaAttitude_rad)};
    }));
    constexpr double kAlmostSure = 0.99999;
    EXPECT_TRUE(nees_bounds(kAlmostSure, 3, 740).contains(accuracy.mean_nees.position));
    EXPECT_TRUE(nees_bounds(kAlmostSure, 3, 740).contains(accuracy.mean_nees.velocity));
    EXPECT_TRUE(nees_bounds(kAlmostSure, 3, 740).contains(accuracy.mean_nees.attitude));
    EXPECT_TRUE(nees_bounds(kAlmostSure, 9, 740).contains(accuracy.mean_nees.joint));
  });
}

void compare_range(FrameReport& report, RangeOutcome outcome, double measured_m) {
  report.range_outcome = outcome;
  report.range_measured_m = measured_m;
  report.range_predicted_m = 7.0;
  report.range_sigma_m = 0.1;
}

TEST(Accuracy, InnovationsCountWhetherUsedOrRefused) {
  FlightLog log = flight_with([](int) { return NavError{}; });
  EXPECT_TRUE(std::isnan(evaluate(log).feature_nis));
  EXPECT_TRUE(std::isnan(evaluate(log).track_nis));
  EXPECT_TRUE(std::isnan(evaluate(log).ranged_nis));
  EXPECT_TRUE(std::isnan(evaluate(log).range_nis));
  FrameReport& first = log.points[10].report;
  first.slam_used = 3;
  first.slam_nis = 5.0;
  first.track_rows = 30;
  first.track_nis = 20.0;
  first.ranged_judged = 2;
  first.ranged_nis = 1.5;
  compare_range(first, RangeOutcome::kUsed, 7.2);
  FrameReport& second = log.points[20].report;
  second.slam_rejected = 1;
  second.slam_nis = 11.0;
  second.track_rows = 10;
  second.track_nis = 40.0;
  second.ranged_judged = 1;
  second.ranged_nis = 3.0;
  compare_range(second, RangeOutcome::kGated, 6.6);
  log.points[30].report.range_outcome = RangeOutcome::kNoFacet;  // was not compared
  EXPECT_DOUBLE_EQ(evaluate(log).feature_nis, 4.0);
  EXPECT_DOUBLE_EQ(evaluate(log).track_nis, 1.5);
  EXPECT_DOUBLE_EQ(evaluate(log).ranged_nis, 1.5);
  EXPECT_NEAR(evaluate(log).range_nis, 10.0, 1e-9);
}

TEST(Accuracy, DivergenceIsCalledByItsName) {
  EXPECT_TRUE(evaluate(FlightLog{}).diverged);
  EXPECT_FALSE(evaluate(FlightLog{}).started);

  const Accuracy runaway = evaluate(flight_with([](int k) { return NavError{Vec3(0.1 * k, 0.0, 0.0), {}, {}}; }));
  EXPECT_TRUE(runaway.diverged);

  FlightLog reset = flight_with([](int) { return NavError{}; });
  reset.counters.resets = 1;
  EXPECT_TRUE(evaluate(reset).diverged);

  FlightLog broken = flight_with([](int) { return NavError{}; });
  broken.points[300].estimate.p_WI_m[1] = std::nan("");
  EXPECT_TRUE(evaluate(broken).diverged);
}

TEST(Accuracy, ChiSquareQuantileMatchesTheTables) {
  EXPECT_NEAR(chi_square_quantile(0.95, 10.0), 18.307, 0.02);
  EXPECT_NEAR(chi_square_quantile(0.05, 30.0), 18.493, 0.02);
  EXPECT_NEAR(chi_square_quantile(0.025, 60.0), 40.482, 0.02);
  EXPECT_NEAR(chi_square_quantile(0.975, 60.0), 83.298, 0.02);
}

}  // namespace
}  // namespace plumb::sim
