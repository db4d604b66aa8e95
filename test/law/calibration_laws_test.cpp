// Calibration in the filter: every new Jacobian against differences of the true model, and what must hold when nothing
// is estimated. (That range rows and images are the dense joint estimate of all states, calibration among them, is in
// filter_laws_test.cpp.)

#include <gtest/gtest.h>

#include <memory>

#include "fsw/estimator/range_model.h"
#include "test/support/dense_filter.h"
#include "test/support/sim/flight.h"
#include "test/support/track_case.h"

namespace plumb {
namespace {

using test::index;
using test::numeric_jacobian;
using test::TinyConfig;
using test::Vec6;
using State = FilterState<TinyConfig>;
using Layout = ErrorLayout<TinyConfig>;

/// The error (theta, xi_p) that takes `estimate` to `truth`, to first order.
Vec6 pose_error(const CameraPose& truth, const CameraPose& estimate) {
  const Mat3 turn = truth.R_WC * estimate.R_WC.transpose();
  Vec6 e;
  e << so3_log(Quat(turn)), truth.p_WC_m - turn * estimate.p_WC_m;
  return e;
}

TEST(CalibrationJacobian, OfTheCloneOnOffsetAndMounting) {
  test::for_all(200, [](test::Generator& g) {
    const CalibrationState nominal(test::nadir_calibration());
    KinematicState motion = test::core_over_ground(g, 3).motion;
    motion.q_WI = test::any_attitude(g);
    const Vec3 rate_I = g.normal_vector<3>(1.0);
    const CameraPose estimate = nominal.camera(motion);
    using Vec7 = Eigen::Matrix<double, 7, 1>;
    const auto numeric = numeric_jacobian<6, 7>(
        [&](const Vec7& e) {
          CalibrationState truth = nominal;
          truth.retract_camera(e.data());
          KinematicState then = motion;  // the image was taken e(0) later than thought
          then.p_WI_m += e(0) * motion.v_WI_m_s;
          then.q_WI = motion.q_WI * so3_exp(e(0) * rate_I);
          return pose_error(truth.camera(then), estimate);
        },
        1e-6);
    EXPECT_LT((nominal.camera_by_mount(motion, rate_I) - numeric).norm(), 1e-7 * numeric.norm());
  });
}

// A clone carries the calibration errors: its covariance is that of the pose as a function of everything else.
TEST(CalibrationLaw, ACloneKnowsWhatItHangsOn) {
  test::for_all(40, [](test::Generator& g) {
    auto state = std::make_unique<State>();
    test::fill_state(g, test::nadir_calibration(), 2, *state);
    state->drop_pose(0);
    const Vec3 rate_I = g.normal_vector<3>(0.5);
    const CameraPose camera = state->calibration().camera(state->core.motion);
    test::Dense by_state = test::numeric_state_jacobian(*state, 6, [&](const State& s) {
      return Eigen::VectorXd(pose_error(s.calibration().camera(s.core.motion), camera));
    });
    by_state.col(index(Layout::kCameraMount)) = state->calibration().camera_by_mount(state->core.motion, rate_I).col(0);
    const test::Dense p = test::dense(state->covariance());
    state->clone_camera(77, rate_I);
    const auto slot = index(Layout::pose(state->window().back()));
    test::Dense whole = test::Dense::Identity(p.rows(), p.cols());
    whole.middleRows(slot, 6) = by_state;
    EXPECT_LT(test::covariance_difference(test::congruent(whole, p), test::dense(state->covariance())), 1e-6);
    test::expect_symmetric_bit_for_bit(state->covariance());
  });
}

TEST(CalibrationJacobian, OfTheRangeOnTheBeam) {
  test::for_all(200, [](test::Generator& g) {
    auto state = std::make_unique<State>();
    test::fill_state(g, test::nadir_calibration(), 0, *state);
    const CameraPose camera = state->calibration().camera(state->core.motion);
    Facet facet;
    for (std::size_t j = 0; j < 3; ++j) {
      const double angle = 2.1 * static_cast<double>(j) + g.uniform(-0.3, 0.3);
      const Vec3 seen(0.3 * std::cos(angle), 0.3 * std::sin(angle), 1.0);
      const CameraPose anchor = state->pose(state->window()[j]).camera;
      facet[j] = {anchor, test::feature_of(anchor, camera.p_WC_m + camera.R_WC * seen * g.uniform(3.0, 6.0))};
    }
    CalibrationState nominal(test::nadir_calibration());
    const Eigen::Matrix<double, 5, 1> start = g.normal_vector<5>(0.05);
    nominal.retract_beam(start.data());  // away from where the tilt is zero
    const auto predicted = [&](const CalibrationState& c) {
      RangePrediction p;
      EXPECT_EQ(predict_range(camera, {c.sensors().p_CR_m, c.sensors().u_C}, facet, p), Status::kOk);
      return p;
    };
    const auto numeric = numeric_jacobian<1, 5>(
        [&](const Eigen::Matrix<double, 5, 1>& e) {
          CalibrationState moved = nominal;
          moved.retract_beam(e.data());
          return Eigen::Matrix<double, 1, 1>(predicted(moved).range_m);
        },
        1e-6);
    Row5 analytic;
    const RangePrediction p = predicted(nominal);
    analytic << p.by_direction * nominal.beam_by_tilt(), p.by_origin;
    EXPECT_LT((analytic - numeric).norm(), 1e-6 * numeric.norm());
  });
}

TEST(CalibrationJacobian, OfTheKnownDepthOnTheBeam) {
  test::for_all(200, [](test::Generator& g) {
    CalibrationState nominal(test::nadir_calibration());
    const Eigen::Matrix<double, 5, 1> start = g.normal_vector<5>(0.05);
    nominal.retract_beam(start.data());
    RangeRay ray;
    ray.range_m = g.uniform(1.0, 20.0);
    ray.spot_C_m = nominal.sensors().impact_C_m(ray.range_m);
    ray.axis_C = so3_exp(g.normal_vector<3>(0.1)) * Vec3::UnitZ();
    KnownDepth known;
    known.rho_1_m = 1.0 / (ray.axis_C.dot(ray.spot_C_m) + g.normal(0.1));
    const auto corrected = [&](const CalibrationState& c) {
      KnownDepth out = known;
      c.correct(ray, out);
      return out;
    };
    EXPECT_NEAR(corrected(nominal).rho_1_m, known.rho_1_m, 1e-12);  // nothing has changed since
    const auto numeric = numeric_jacobian<1, 5>(
        [&](const Eigen::Matrix<double, 5, 1>& e) {
          CalibrationState moved = nominal;
          moved.retract_beam(e.data());
          return Eigen::Matrix<double, 1, 1>(corrected(moved).rho_1_m);
        },
        1e-6);
    EXPECT_LT((corrected(nominal).by_beam - numeric).norm(), 1e-6 * numeric.norm());
  });
}

// The row of a ranged track, r = H dx with dx = (feature, beam, poses): a beam off by e explains the residual it makes.
TEST(CalibrationJacobian, OfTheRangedTrackOnTheBeam) {
  test::for_all(100, [](test::Generator& g) {
    const test::TrackCase c = test::any_track(g, 0.0);
    KnownDepth known;
    known.view = static_cast<std::size_t>(g.integer(0, static_cast<int>(c.views.size()) - 1));
    known.rho_1_m = test::feature_of(c.views[known.view].camera, c.point).z();
    known.sigma_1_m = 0.01 * known.rho_1_m;
    known.by_beam = g.normal_vector<5>(1.0).transpose();
    TrackRows<test::kTrackPoses, kBeamSize> rows;
    rows.feature = test::feature_of(c.views.back().camera, c.point);
    rows.rows = 1;
    const Eigen::Matrix<double, 5, 1> e = g.normal_vector<5>(1e-3);
    known.rho_1_m -= known.by_beam * e;  // the beam is taken for e less than it is
    ASSERT_EQ(add_range_row(c.views, known, rows), Status::kOk);
    const auto row = test::dense(rows.work.view(1, rows.kColumns));
    const double explained = row.block<1, 5>(0, index(kFeatureSize)) * e;
    EXPECT_NEAR(row(0, index(rows.kColumns) - 1), explained, 1e-8);
  });
}

TEST(CalibrationJacobian, OfTheFlightOnTheScaleOfTheImu) {
  test::for_all(60, [](test::Generator& g) {
    const ImuOptions options;
    CoreState core = test::core_over_ground(g, 2);
    core.motion.q_WI = test::any_attitude(g);
    core.gyro_scale = g.normal_vector<3>(0.01);
    core.accel_scale = g.normal_vector<3>(0.01);
    std::vector<InertialRates> read;
    for (int k = 0; k < 13; ++k) read.push_back({g.normal_vector<3>(0.5), g.normal_vector<3>(8.0)});
    for (std::size_t k = 1; k < read.size(); ++k) {  // a rate that varies as a vehicle's does, not as noise
      read[k].gyro_rad_s = read[k - 1].gyro_rad_s + 0.01 * read[k].gyro_rad_s;
      read[k].accel_m_s2 = read[k - 1].accel_m_s2 + 0.01 * read[k].accel_m_s2;
    }
    const auto fly = [&](CoreState s, CoreTransition& transition) {
      for (std::size_t k = 1; k < read.size(); ++k)
        propagate_step(s, transition, {read[k - 1], read[k], 0.004, 0.004}, options);
      return s;
    };
    CoreTransition transition;
    transition.with_scale = true;
    const CoreState end = fly(core, transition);
    const auto numeric = numeric_jacobian<9, 6>(
        [&](const Vec6& e) {
          CoreState truth = core;
          truth.gyro_scale += e.head<3>();
          truth.accel_scale += e.tail<3>();
          CoreTransition unused;
          truth = fly(truth, unused);
          const Quat turn = truth.motion.q_WI * end.motion.q_WI.conjugate();
          Eigen::Matrix<double, 9, 1> error;
          error << so3_log(turn), truth.motion.p_WI_m - turn * end.motion.p_WI_m,
              truth.motion.v_WI_m_s - turn * end.motion.v_WI_m_s;
          return error;
        },
        1e-5);
    EXPECT_LT((transition.by_scale.topRows<9>() - numeric).norm(), 1e-4 * numeric.norm());
    EXPECT_EQ(transition.by_scale.bottomRows<6>().norm(), 0.0);
  });
}

TEST(CalibrationLaw, AddLinearIsTheDenseProduct) {
  test::for_all(100, [](test::Generator& g) {
    MatrixStorage<20, 20> storage;
    const test::Dense p = test::any_covariance(g, 20);
    test::store(p, storage.view());
    const test::Dense j = test::any_matrix(g, 6, 7);
    MatrixStorage<6, 7> jacobian;
    test::store(j, jacobian.view());
    const bool up = g.integer(0, 1) == 0;
    const Eigen::Index at = up ? 1 : 12;
    const Eigen::Index from = up ? 9 : 3;
    add_linear(storage.view(), static_cast<std::size_t>(at), jacobian.view(), static_cast<std::size_t>(from));
    test::Dense whole = test::Dense::Identity(20, 20);
    whole.block(at, from, 6, 7) = j;
    EXPECT_LT(test::difference(test::dense(storage.view()), test::congruent(whole, p)), 1e-12);
    test::expect_symmetric_bit_for_bit(storage.view());
  });
}

// Room for calibration that is not used leaves every bit of a flight as it is.
TEST(CalibrationLaw, WhatIsNotEstimatedChangesNoBit) {
  constexpr double kHeight_m = 11.0;
  constexpr double kLength_s = 12.0;
  const sim::Scene scene{"short", sim::cruise_from_start(kHeight_m, kLength_s), sim::stepped_ground(),
                         sim::nadir_rig()};
  sim::FlightSettings settings;
  settings.range.outlier = 0.02;
  EstimatorOptions options = sim::matched_options(settings);
  options.range.facet_after_s = 0.0;  // ranges on tracks and on facets
  const sim::FlightLog without = sim::fly<FlightConfig>(scene, settings, options);
  const sim::FlightLog with_room = sim::fly<SelfCalibratingConfig>(scene, settings, options);
  ASSERT_EQ(without.points.size(), with_room.points.size());
  ASSERT_TRUE(without.points.back().estimate.valid);
  ASSERT_GT(without.counters.ranges_used, 0U);
  ASSERT_GT(without.counters.ranges_feature, 0U);
  for (std::size_t i = 0; i < without.points.size(); ++i) {
    ASSERT_EQ(without.points[i].state_hash, with_room.points[i].state_hash) << i;
  }
}

}  // namespace
}  // namespace plumb
