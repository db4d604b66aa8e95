#pragma once
// Random poses, features and filter states for the tests of the estimator.

#include <vector>

#include "fsw/estimator/filter_state.h"
#include "fsw/estimator/options.h"
#include "fsw/estimator/visual_model.h"
#include "test/support/dense.h"

namespace plumb::test {

/// A filter small enough to be compared with dense algebra thousands of times.
struct TinyConfig {
  static constexpr const char* kName = "tiny";
  static constexpr std::size_t kMaxPoses = 5;
  static constexpr std::size_t kMaxSlamFeatures = 6;
  static constexpr std::size_t kMaxTracks = 24;
  static constexpr std::size_t kMaxMsckfPerFrame = 8;
  static constexpr CalibrationBlocks kCalibration{.imu_scale = true, .camera = true, .range_finder = true};
};

using Vec6 = Eigen::Matrix<double, 6, 1>;
using Vec15 = Eigen::Matrix<double, 15, 1>;

inline Quat any_attitude(Generator& g) { return so3_exp(g.uniform(0.0, 3.0) * g.direction()); }

/// A pose moved by the true retraction of its error (theta, xi_p).
inline CameraPose moved(const CameraPose& pose, const Vec6& error) {
  Quat q(pose.R_WC);
  Vec3 p = pose.p_WC_m;
  retract_pose(error.head<3>(), error.tail<3>(), q, p);
  return {q.toRotationMatrix(), p};
}

/// Any camera that has `point` in view, within 40 degrees of its axis and 0.5 to 20 m away.
inline CameraPose camera_seeing(Generator& g, const Vec3& point) {
  CameraPose camera;
  camera.R_WC = any_attitude(g).toRotationMatrix();
  const Vec3 ray(g.uniform(-0.6, 0.6), g.uniform(-0.6, 0.6), 1.0);
  camera.p_WC_m = point - camera.R_WC * ray * g.uniform(0.5, 20.0);
  return camera;
}

/// The parameters of a world point in an anchor that sees it.
inline FeatureParameters feature_of(const CameraPose& anchor, const Vec3& point) {
  const Vec3 c = anchor.R_WC.transpose() * (point - anchor.p_WC_m);
  return {c.x() / c.z(), c.y() / c.z(), 1.0 / c.z()};
}

/// A camera that looks down, with a mounting that is off in every respect.
inline SensorCalibration nadir_calibration() {
  SensorCalibration c;
  Mat3 down;
  down << 0.0, -1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, -1.0;
  c.q_IC = (Quat(down) * so3_exp(Vec3(0.03, -0.02, 0.04))).normalized();
  c.p_IC_m = Vec3(0.08, -0.03, -0.05);
  c.p_CR_m = Vec3(0.04, 0.01, -0.005);
  c.u_C = Vec3(0.02, -0.015, 1.0).normalized();
  c.focal_px = 400.0;
  c.half_fov_x = 0.8;
  c.half_fov_y = 0.6;
  return c;
}

/// Where the camera of this core state stands.
inline CameraPose camera_of(const CoreState& core, const SensorCalibration& calibration) {
  return {(core.motion.q_WI * calibration.q_IC).toRotationMatrix(),
          core.motion.p_WI_m + core.motion.q_WI * calibration.p_IC_m};
}

/// A core state in level flight 5 m over the ground, at the k-th image of a straight pass.
inline CoreState core_over_ground(Generator& g, std::size_t k) {
  CoreState core;
  core.motion.q_WI = so3_exp(Vec3(g.normal(0.05), g.normal(0.05), 0.3 + g.normal(0.05))).normalized();
  core.motion.p_WI_m = Vec3(0.4 * static_cast<double>(k), g.normal(0.1), 5.0 + g.normal(0.1));
  core.motion.v_WI_m_s = Vec3(4.0, 0.0, 0.0) + g.normal_vector<3>(0.3);
  core.b_gyro_rad_s = g.normal_vector<3>(0.01);
  core.b_accel_m_s2 = g.normal_vector<3>(0.05);
  return core;
}

inline Vec3 any_ground_point(Generator& g) {
  return {g.uniform(-0.5, 2.5), g.uniform(-1.5, 1.5), g.uniform(-0.3, 0.3)};
}

/// 1 sigma of the prior of each active state, in its own unit.
template <class Config>
Eigen::VectorXd prior_sigmas(const FilterState<Config>& state) {
  using Layout = ErrorLayout<Config>;
  Eigen::VectorXd s = Eigen::VectorXd::Constant(index(state.size()), 0.01);
  s.segment<3>(kXiP).setConstant(0.03);
  s.segment<3>(kXiV).setConstant(0.05);
  for (std::size_t slot = 0; slot < Config::kMaxPoses; ++slot)
    s.segment<3>(index(Layout::pose(slot) + 3)).setConstant(0.03);
  return s;
}

/// Everything is estimated.
inline CalibrationOptions any_calibration_options() { return {0.01, 0.01, 0.01, 0.01, 0.01, 0.01, 0.01}; }

/// A full window over the ground and `features` features anchored all over it, under a covariance that correlates
/// everything with everything. Returns the world points of the features.
template <class Config>
std::vector<Vec3> fill_state(Generator& g, const SensorCalibration& calibration, std::size_t features,
                             FilterState<Config>& state) {
  state.clear();
  state.t = Time::from_seconds(100.0);
  state.set_calibration(calibration, {});
  for (std::size_t k = 0; k < Config::kMaxPoses; ++k) {
    state.core = core_over_ground(g, k);
    state.clone_camera(static_cast<std::uint32_t>(k));
  }
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < features; ++i) {
    const auto anchor = static_cast<std::size_t>(g.integer(0, static_cast<std::int64_t>(Config::kMaxPoses) - 1));
    points.push_back(any_ground_point(g));
    const SlamFeature feature{static_cast<std::uint32_t>(100 + i), anchor,
                              feature_of(state.pose(anchor).camera, points.back()), 0};
    EXPECT_EQ(state.add_feature(feature, Mat3::Identity()), Status::kOk);
  }
  state.set_calibration(calibration, any_calibration_options());
  store(scaled(any_covariance(g, state.size()), prior_sigmas(state)), state.covariance());
  return points;
}

/// The directions no sensor observes: common translation (3) and a common turn about gravity (1), as columns.
template <class Config>
Dense unobservable_directions(const FilterState<Config>& state) {
  using Layout = ErrorLayout<Config>;
  Dense n = Dense::Zero(index(state.size()), 4);
  const auto put = [&n](std::size_t theta) {
    n.block<3, 3>(index(theta + 3), 0).setIdentity();
    n(index(theta + 2), 3) = 1.0;
  };
  put(kTheta);
  for (std::size_t slot : state.window()) put(Layout::pose(slot));
  return n;
}

}  // namespace plumb::test
