#pragma once
// What standing still tells the filter: no velocity, no rotation, and at the start that the specific force is gravity.

#include "fsw/estimator/options.h"
#include "fsw/estimator/stillness.h"
#include "fsw/estimator/update_stack.h"

namespace plumb {

/// Level attitude from the mean specific force at rest: the turn that levels I and nothing about the vertical, which is
/// what "yaw zero" means here (an Euler angle would not do: the body's x axis may be the vertical one).
inline Quat level_attitude(const Vec3& mean_accel_m_s2) { return rotation_between(mean_accel_m_s2, Vec3::UnitZ()); }

/// How sure standing still is: what the images could have missed. [m/s, rad/s], 1 sigma of one image's evidence.
struct StandingNoise {
  double velocity_m_s = 0.0;
  double rate_rad_s = 0.0;
};

/// Zero velocity, as seen from I: R^T v = R_hat^T (v_hat + xi_v) to first order, so that attitude has no part in it and
/// no heading is learnt, whatever the estimate of v is. Three rows turned into W. A velocity that contradicts it beyond
/// all doubt is left alone (kRejected).
template <class Config>
Status add_zero_velocity(const FilterState<Config>& state, UpdateStack<Config>& stack, double sigma_m_s) {
  constexpr double kGate = 27.9;  // chi-square, 3 degrees of freedom, 4e-6: only a false detection fails it
  MatrixView h = stack.open(3);
  h.fixed<3, 3>(0, kXiV) = Mat3::Identity() / sigma_m_s;
  for (std::size_t k = 0; k < 3; ++k) {
    stack.residual(k) = -state.core.motion.v_WI_m_s(static_cast<Eigen::Index>(k)) / sigma_m_s;
  }
  Support support;
  static_cast<void>(support.push_back({kXiV, 3}));
  if (stack.close(state, support) <= kGate) return Status::kOk;
  stack.discard(3);
  return Status::kRejected;
}

/// No rotation: the mean gyro reading is its bias.
template <class Config>
void add_zero_rate(const FilterState<Config>& state, UpdateStack<Config>& stack, const Vec3& mean_gyro_rad_s,
                   double sigma_rad_s) {
  MatrixView h = stack.open(3);
  h.fixed<3, 3>(0, kGyroBias) = Mat3::Identity() / sigma_rad_s;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto e = static_cast<Eigen::Index>(k);
    stack.residual(k) = (mean_gyro_rad_s(e) - state.core.b_gyro_rad_s(e)) / sigma_rad_s;
  }
  Support support;
  static_cast<void>(support.push_back({kGyroBias, 3}));
  stack.close_untested(state, support);
}

/// No acceleration: the mean accelerometer reading, its scale factors not yet corrected, is gravity seen from I plus
/// bias.
template <class Config>
void add_gravity(const FilterState<Config>& state, UpdateStack<Config>& stack, const Vec3& mean_accel_m_s2,
                 double gravity_m_s2, double sigma_m_s2) {
  const Mat3 r_transposed = state.core.motion.q_WI.toRotationMatrix().transpose();
  const Vec3 up(0.0, 0.0, gravity_m_s2);
  MatrixView h = stack.open(3);
  // R^T up = R_hat^T Exp(-theta) up
  h.fixed<3, 3>(0, kTheta) = r_transposed * skew(up) / sigma_m_s2;
  h.fixed<3, 3>(0, kAccelBias) = Mat3::Identity() / sigma_m_s2;
  Support support;
  using Layout = ErrorLayout<Config>;
  if constexpr (Layout::kBlocks.imu_scale) {
    const Vec3 expected_m_s2 = r_transposed * up + state.core.b_accel_m_s2;
    h.fixed<3, 3>(0, Layout::kImuScale + 3) = -Mat3(expected_m_s2.asDiagonal()) / sigma_m_s2;
    static_cast<void>(support.push_back({Layout::kImuScale + 3, 3}));
  }
  const Vec3 residual = (mean_accel_m_s2 - r_transposed * up - state.core.b_accel_m_s2) / sigma_m_s2;
  for (std::size_t k = 0; k < 3; ++k) stack.residual(k) = residual(static_cast<Eigen::Index>(k));
  static_cast<void>(support.push_back({kTheta, 3}));
  static_cast<void>(support.push_back({kAccelBias, 3}));
  stack.close_untested(state, support);
}

}  // namespace plumb
