// The truth must be consistent with itself: rates are the derivatives of what they are rates of, and an IMU that makes
// no errors leads back to the trajectory.

#include "test/support/sim/trajectory.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fsw/math/strapdown.h"
#include "test/support/sim/imu_model.h"
#include "test/support/sim/scene.h"

namespace plumb::sim {
namespace {

constexpr double kStep_s = 1e-4;     // of the central differences
constexpr double kTolerance = 2e-6;  // what is left of them: third derivatives times kStep_s^2

class EveryScene : public testing::TestWithParam<std::string_view> {};

TEST_P(EveryScene, RatesAreDerivatives) {
  const Trajectory trajectory = make_scene(GetParam()).trajectory;
  for (double t_s = 0.05; t_s < trajectory.length_s(); t_s += 0.137) {
    const TruthState before = trajectory.at(t_s - kStep_s);
    const TruthState now = trajectory.at(t_s);
    const TruthState after = trajectory.at(t_s + kStep_s);
    const Vec3 velocity = (after.p_WI_m - before.p_WI_m) / (2.0 * kStep_s);
    const Vec3 acceleration = (after.v_WI_m_s - before.v_WI_m_s) / (2.0 * kStep_s);
    const Vec3 rate = so3_log(before.q_WI.conjugate() * after.q_WI) / (2.0 * kStep_s);
    EXPECT_LT((velocity - now.v_WI_m_s).norm(), kTolerance) << "t = " << t_s;
    EXPECT_LT((acceleration - now.a_WI_m_s2).norm(), kTolerance) << "t = " << t_s;
    EXPECT_LT((rate - now.omega_I_rad_s).norm(), kTolerance) << "t = " << t_s;
  }
}

TEST_P(EveryScene, NoiseFreeImuReproducesTheTrajectory) {
  constexpr double kRate_hz = 2000.0;  // the integrator's own error falls with its square: 1.1 mm at 1 kHz when lively
  constexpr double kSpan_s = 60.0;
  constexpr double kGravity_m_s2 = 9.80665;
  const Trajectory trajectory = make_scene(GetParam()).trajectory;
  ImuModel imu(noise_free(), kRate_hz, kGravity_m_s2, 1);
  const auto rates_at = [&](double t_s) {
    const ImuSample sample = imu.sample(trajectory.at(t_s), Time::from_seconds(t_s));
    return InertialRates{Vec3(sample.gyro_rad_s.data()), Vec3(sample.accel_m_s2.data())};
  };
  const TruthState start = trajectory.at(0.0);
  KinematicState state{start.q_WI, start.p_WI_m, start.v_WI_m_s};
  InertialRates previous = rates_at(0.0);
  const int steps = static_cast<int>(std::min(kSpan_s, trajectory.length_s()) * kRate_hz);
  for (int k = 1; k <= steps; ++k) {
    const InertialRates next = rates_at(k / kRate_hz);
    strapdown_step(state, previous, next, 1.0 / kRate_hz, kGravity_m_s2);
    previous = next;
  }
  const TruthState end = trajectory.at(steps / kRate_hz);
  EXPECT_LT((state.p_WI_m - end.p_WI_m).norm(), 1e-3);
  EXPECT_LT((state.v_WI_m_s - end.v_WI_m_s).norm(), 1e-4);
  EXPECT_LT(so3_log(state.q_WI.conjugate() * end.q_WI).norm(), 1e-6);
}

INSTANTIATE_TEST_SUITE_P(Scenes, EveryScene, testing::ValuesIn(scene_names().begin(), scene_names().end()),
                         [](const auto& scene) { return std::string(scene.param); });

TEST(Trajectory, OutdoorCruiseFliesThePaperProfile) {
  const Rig rig = nadir_rig();
  const Trajectory trajectory = outdoor_cruise(rig.ground_position_m(0.3));
  EXPECT_NEAR(rig.p_WC_m(trajectory.at(1.0)).z(), 0.3, 1e-12);
  EXPECT_EQ(trajectory.at(2.9).v_WI_m_s.norm(), 0.0);
  EXPECT_NEAR(trajectory.at(40.0).p_WI_m.z(), 11.0, 1e-12);
  for (double t_s = trajectory.cruise_start_s(); t_s <= trajectory.cruise_end_s(); t_s += 1.0) {
    EXPECT_NEAR((trajectory.at(t_s).v_WI_m_s - Vec3(2.0, 0.0, 0.0)).norm(), 0.0, 1e-12);
    EXPECT_NEAR(trajectory.at(t_s).a_WI_m_s2.norm(), 0.0, 1e-12);
  }
  EXPECT_EQ(trajectory.length_s(), 75.0);
}

TEST(Trajectory, CruiseFromStartIsNeverExcited) {
  const Trajectory trajectory = cruise_from_start();
  EXPECT_NEAR((trajectory.at(0.0).p_WI_m - Vec3(0.0, 0.0, 11.0)).norm(), 0.0, 1e-12);
  for (double t_s = 0.0; t_s < trajectory.length_s(); t_s += 0.5) {
    EXPECT_EQ(trajectory.at(t_s).a_WI_m_s2.norm(), 0.0);
    EXPECT_EQ(trajectory.at(t_s).omega_I_rad_s.norm(), 0.0);
    EXPECT_EQ(trajectory.at(t_s).v_WI_m_s, Vec3(2.0, 0.0, 0.0));
  }
}

TEST(Trajectory, LeaningBodyFeelsThrustAlongItsOwnAxis) {
  const Trajectory trajectory = make_scene("excitation").trajectory;
  for (double t_s = 0.0; t_s < trajectory.length_s(); t_s += 0.31) {
    const TruthState truth = trajectory.at(t_s);
    const Vec3 force = truth.q_WI.conjugate() * (truth.a_WI_m_s2 + 9.80665 * Vec3::UnitZ());
    EXPECT_LT(force.head<2>().norm(), 1e-12);
  }
}

TEST(SmoothStep, DerivativesFitTogether) {
  constexpr double kDx = 1e-5;
  for (double x = -0.1; x < 1.1; x += 0.037) {
    for (const auto& function : {smooth_step, smooth_step_integral}) {
      const Jet low = function(x - kDx);
      const Jet high = function(x + kDx);
      const Jet middle = function(x);
      for (int order = 0; order < 3; ++order) {
        EXPECT_NEAR((high[order] - low[order]) / (2.0 * kDx), middle[order + 1], 1e-6) << "x " << x << ", " << order;
      }
    }
  }
}

}  // namespace
}  // namespace plumb::sim
