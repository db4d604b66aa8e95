// The same theorem on the flight code's own models: its error dynamics, its projection and its ranged facet, with the
// right-invariant error and anchored inverse-depth features. And what that error is for: the directions that nothing
// can observe stay unobservable at any estimate, consistent with the others or not.

#include <gtest/gtest.h>

#include <array>

#include "fsw/estimator/propagation.h"
#include "fsw/estimator/range_model.h"
#include "test/law/linear_system.h"
#include "test/support/property.h"
#include "test/support/sim/scene.h"

namespace plumb::law {
namespace {

constexpr std::size_t kFeatures = 8;
constexpr double kImuPeriod_s = 0.004;
constexpr int kImuPerImage = 50;
constexpr int kImages = 30;
constexpr double kInNullSpace = 1e-9;
constexpr double kOutOfNullSpace = 1e-3;

/// A filter state at the first image: core, the clone of its camera pose, and features anchored there. The clone shares
/// the core's error, so the unknowns are the core's 15 and three per feature.
struct FlightSystem {
  sim::Trajectory trajectory;
  double start_s = 0.0;
  sim::Rig rig;
  std::vector<FeatureParameters> features;

  Eigen::Index size() const { return feature_at(features.size()); }
};

CameraPose camera_of(const sim::Rig& rig, const KinematicState& motion) {
  return {(motion.q_WI * rig.q_IC).toRotationMatrix(), motion.p_WI_m + motion.q_WI * rig.p_IC_m};
}

KinematicState kinematics(const sim::TruthState& truth) { return {truth.q_WI, truth.p_WI_m, truth.v_WI_m_s}; }

FlightSystem flight_system(const char* scene_name, double start_s, test::Generator& g) {
  FlightSystem system{sim::make_scene(scene_name).trajectory, start_s, sim::plain_rig(), {}};
  const std::array<Vec2, 3> around_the_beam = {Vec2(-0.3, -0.25), Vec2(0.35, -0.2), Vec2(0.0, 0.3)};
  for (std::size_t j = 0; j < kFeatures; ++j) {
    const Vec2 direction = j < 3 ? around_the_beam[j] : Vec2(g.uniform(-0.5, 0.5), g.uniform(-0.5, 0.5));
    system.features.emplace_back(direction.x(), direction.y(), g.uniform(0.08, 0.12));
  }
  return system;
}

/// Rows of one image and one range at the first image's unknowns.
void append_rows(const FlightSystem& system, const CameraPose& camera, const CameraPose& anchor, const Mat15& phi,
                 bool with_range, std::vector<Eigen::RowVectorXd>& rows) {
  const auto by_core = [&](const Row6& by_pose) { return (by_pose * phi.topRows<6>()).eval(); };
  for (std::size_t j = 0; j < system.features.size(); ++j) {
    VisualPrediction seen;
    ASSERT_EQ(predict_feature(camera, anchor, system.features[j], seen), Status::kOk);
    for (int axis = 0; axis < 2; ++axis) {
      Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(system.size());
      row.head<15>() = by_core(seen.by_pose.row(axis));
      row.head<6>() -= seen.by_pose.row(axis);  // the anchor's Jacobian is the negative
      row.segment<3>(feature_at(j)) = seen.by_feature.row(axis);
      rows.push_back(row);
    }
  }
  if (!with_range) return;
  Facet facet;
  for (std::size_t j = 0; j < 3; ++j) facet[j] = {anchor, system.features[j]};
  RangePrediction range;
  ASSERT_EQ(predict_range(camera, {system.rig.p_CR_m, system.rig.u_C}, facet, range), Status::kOk);
  Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(system.size());
  row.head<15>() = by_core(range.by_camera);
  for (std::size_t j = 0; j < 3; ++j) {
    row.head<6>() += range.by_anchor[j];
    row.segment<3>(feature_at(j)) += range.by_feature[j];
  }
  rows.push_back(row);
}

InertialRates rates_at(const sim::Trajectory& trajectory, double t_s) {
  const sim::TruthState truth = trajectory.at(t_s);
  return {truth.omega_I_rad_s, truth.q_WI.conjugate() * (truth.a_WI_m_s2 + kGravity_m_s2 * Vec3::UnitZ())};
}

/// Observability matrix along the true motion. With a `disturb` generator every image is linearised at its own wrong
/// estimate, as a filter does that is corrected between images.
Matrix matrix_of(const FlightSystem& system, bool with_range, test::Generator* disturb = nullptr) {
  ImuOptions imu;
  imu.gravity_m_s2 = kGravity_m_s2;
  CoreState core{kinematics(system.trajectory.at(system.start_s)), Vec3::Zero(), Vec3::Zero()};
  const CameraPose anchor = camera_of(system.rig, core.motion);
  CoreTransition transition;
  std::vector<Eigen::RowVectorXd> rows;
  for (int image = 0; image < kImages; ++image) {
    append_rows(system, camera_of(system.rig, core.motion), anchor, transition.phi, with_range, rows);
    for (int k = 0; k < kImuPerImage; ++k) {
      const double t_s = system.start_s + (image * kImuPerImage + k) * kImuPeriod_s;
      const ImuInterval interval{rates_at(system.trajectory, t_s), rates_at(system.trajectory, t_s + kImuPeriod_s),
                                 kImuPeriod_s, kImuPeriod_s};
      propagate_step(core, transition, interval, imu);
    }
    if (disturb == nullptr) continue;
    core.motion.q_WI = so3_exp(disturb->normal_vector<3>(0.01)) * core.motion.q_WI;
    core.motion.p_WI_m += disturb->normal_vector<3>(0.05);
    core.motion.v_WI_m_s += disturb->normal_vector<3>(0.05);
  }
  Matrix m(static_cast<Eigen::Index>(rows.size()), system.size());
  for (std::size_t i = 0; i < rows.size(); ++i) m.row(static_cast<Eigen::Index>(i)) = rows[i];
  return m;
}

/// In this error: xi_p = p, xi_v = v, b_a = -a in the body, and every inverse depth shrinks by its own size.
Vector scale_direction(const FlightSystem& system) {
  const sim::TruthState truth = system.trajectory.at(system.start_s);
  Vector n = Vector::Zero(system.size());
  n.segment<3>(plumb::kXiP) = truth.p_WI_m;
  n.segment<3>(plumb::kXiV) = truth.v_WI_m_s;
  n.segment<3>(plumb::kAccelBias) = -(truth.q_WI.conjugate() * truth.a_WI_m_s2);
  for (std::size_t j = 0; j < system.features.size(); ++j) n(feature_at(j) + 2) = -system.features[j].z();
  return n;
}

Vector core_direction(const FlightSystem& system, std::size_t offset, const Vec3& value) {
  Vector n = Vector::Zero(system.size());
  n.segment<3>(static_cast<Eigen::Index>(offset)) = value;
  return n;
}

TEST(FlightModels, AtConstantVelocityOnlyTheRangeSeesScale) {
  test::for_all(5, [](test::Generator& g) {
    const FlightSystem system = flight_system("cruise_from_start", 5.0, g);
    const Matrix camera = matrix_of(system, false);
    const Matrix ranged = matrix_of(system, true);
    EXPECT_LT(residual(camera, scale_direction(system)), kInNullSpace);
    EXPECT_GT(residual(ranged, scale_direction(system)), kOutOfNullSpace);
    EXPECT_EQ(nullity(camera), nullity(ranged) + 1);
  });
}

TEST(FlightModels, GenericMotionLeavesPositionAndHeadingOnly) {
  test::for_all(3, [](test::Generator& g) {
    const FlightSystem system = flight_system("excitation", 25.0, g);
    EXPECT_GT(residual(matrix_of(system, false), scale_direction(system)), kOutOfNullSpace);
    EXPECT_EQ(nullity(matrix_of(system, false)), 4);
    EXPECT_EQ(nullity(matrix_of(system, true)), 4);
  });
}

TEST(FlightModels, PositionAndHeadingStayUnobservableAtAnyEstimate) {
  test::for_all(5, [](test::Generator& g) {
    for (const char* scene : {"excitation", "cruise_from_start"}) {
      const FlightSystem system = flight_system(scene, 25.0, g);
      const Matrix m = matrix_of(system, true, &g);
      EXPECT_LT(residual(m, core_direction(system, plumb::kXiP, g.normal_vector<3>(1.0))), kInNullSpace);
      EXPECT_LT(residual(m, core_direction(system, plumb::kTheta, Vec3::UnitZ())), kInNullSpace);
      EXPECT_GT(residual(m, core_direction(system, plumb::kTheta, Vec3::UnitX())), kOutOfNullSpace);
    }
  });
}

}  // namespace
}  // namespace plumb::law
