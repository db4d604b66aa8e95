#include "fsw/estimator/propagation.h"

#include <algorithm>

namespace plumb {
namespace {
using Mat1512 = Eigen::Matrix<double, 15, 12, Eigen::RowMajor>;
/// Errors of scale and axes last as long as the rate keeps its direction; the filter knows white noise alone. This is
/// the noise that adds up to the same angle over turns of about a second.
constexpr double kTurnTime_s = 1.0;

// Between samples the rates are taken to be linear. What usual periods hide is part of the noise that the options tell;
// a hole hides more: for its length, the rates may have been off the line by so much, 1 sigma.
constexpr double kUnseenRate_rad_s = 1.0;
constexpr double kUnseenAccel_m_s2 = 20.0;
// A reading at the end of its scale says that the rate is beyond it, for as long as a knock lasts.
constexpr double kClipped = 0.97;  // of the limit
constexpr double kBeyond = 0.25;   // of the limit, 1 sigma
constexpr double kKnock_s = 0.02;

constexpr auto at(std::size_t i) { return static_cast<Eigen::Index>(i); }

/// Noise density squared of what the samples at the ends of an interval do not tell of the rates in it.
double unseen_density2(const ImuInterval& interval, Vec3 InertialRates::* rate, double unseen, double limit) {
  double density2 = 0.0;
  if (interval.hole_s > 0.0) density2 = unseen * unseen * interval.hole_s * interval.hole_s / interval.period_s;
  const auto peak = [rate](const InertialRates& rates) { return (rates.*rate).cwiseAbs().maxCoeff(); };
  if (std::max(peak(interval.start), peak(interval.end)) > kClipped * limit) {
    density2 += kBeyond * kBeyond * limit * limit * kKnock_s;
  }
  return density2;
}

}  // namespace

Quat gyro_rotation(const ImuBuffer& imu, const CoreState& core, Time from, Time to) {
  Quat turn = Quat::Identity();
  imu.for_each_interval(from, to, [&](const ImuInterval& i) {
    const Vec3 mean_rad_s = 0.5 * (i.start.gyro_rad_s + i.end.gyro_rad_s);
    turn = turn * so3_exp(core.rates({mean_rad_s, Vec3::Zero()}).gyro_rad_s * i.dt_s);
  });
  return turn;
}

void retract_pose(const Vec3& theta, const Vec3& xi_p, Quat& q, Vec3& p) {
  const Quat dq = so3_exp(theta);
  p = dq * p + so3_left_jacobian(theta) * xi_p;
  q = (dq * q).normalized();
}

void retract_core(CoreState& core, const double* error) {
  const Vec3 theta(error + kTheta);
  core.motion.v_WI_m_s = so3_exp(theta) * core.motion.v_WI_m_s + so3_left_jacobian(theta) * Vec3(error + kXiV);
  retract_pose(theta, Vec3(error + kXiP), core.motion.q_WI, core.motion.p_WI_m);
  core.b_gyro_rad_s += Vec3(error + kGyroBias);
  core.b_accel_m_s2 += Vec3(error + kAccelBias);
}

Mat15 error_dynamics(const KinematicState& motion, double gravity_m_s2) {
  const Mat3 r = motion.q_WI.toRotationMatrix();
  const Vec3 g(0.0, 0.0, -gravity_m_s2);
  Mat15 f = Mat15::Zero();
  f.block<3, 3>(at(kTheta), at(kGyroBias)) = -r;
  f.block<3, 3>(at(kXiV), at(kTheta)) = skew(g);
  f.block<3, 3>(at(kXiV), at(kGyroBias)) = -skew(motion.v_WI_m_s) * r;
  f.block<3, 3>(at(kXiV), at(kAccelBias)) = -r;
  f.block<3, 3>(at(kXiP), at(kXiV)).setIdentity();
  f.block<3, 3>(at(kXiP), at(kGyroBias)) = -skew(motion.p_WI_m) * r;
  return f;
}

void propagate_step(CoreState& state, CoreTransition& transition, const ImuInterval& interval,
                    const ImuOptions& options) {
  const double dt_s = interval.dt_s;
  const KinematicState before = state.motion;
  const InertialRates a = state.rates(interval.start);
  const InertialRates b = state.rates(interval.end);
  strapdown_step(state.motion, a, b, dt_s, options.gravity_m_s2);

  // Linearise at the middle of the step.
  KinematicState middle;
  middle.q_WI = halfway(before.q_WI, state.motion.q_WI);
  middle.p_WI_m = 0.5 * (before.p_WI_m + state.motion.p_WI_m);
  middle.v_WI_m_s = 0.5 * (before.v_WI_m_s + state.motion.v_WI_m_s);
  const Mat15 f = error_dynamics(middle, options.gravity_m_s2) * dt_s;
  // F is nilpotent of order 4 (bias -> attitude -> velocity -> position): the exponential ends after the cube.
  const Mat15 f2 = f.lazyProduct(f);
  const Mat15 f3 = f2.lazyProduct(f);
  const Mat15 phi = Mat15::Identity() + f + 0.5 * f2 + (1.0 / 6.0) * f3;

  // White noise enters where the biases do, and its sign does not matter to the covariance: G = F's bias columns.
  Mat1512 g = Mat1512::Zero();
  g.leftCols<6>() = f.block<15, 6>(0, at(kGyroBias)) / dt_s;
  g.block<6, 6>(at(kGyroBias), 6).setIdentity();
  Eigen::Matrix<double, 12, 1> density;
  const double rate_error = options.gyro_scale_error * (0.5 * (a.gyro_rad_s + b.gyro_rad_s)).norm();
  const double gyro_density2 =
      options.gyro_noise_density * options.gyro_noise_density + rate_error * rate_error * kTurnTime_s +
      unseen_density2(interval, &InertialRates::gyro_rad_s, kUnseenRate_rad_s, options.max_gyro_rad_s);
  const double accel_density2 =
      options.accel_noise_density * options.accel_noise_density +
      unseen_density2(interval, &InertialRates::accel_m_s2, kUnseenAccel_m_s2, options.max_accel_m_s2);
  density << Vec3::Constant(gyro_density2), Vec3::Constant(accel_density2),
      Vec3::Constant(options.gyro_bias_walk * options.gyro_bias_walk),
      Vec3::Constant(options.accel_bias_walk * options.accel_bias_walk);
  // Phi_half Q_c Phi_half^T dt: exact to second order in dt and positive semidefinite by construction.
  const Mat15 half = Mat15::Identity() + 0.5 * f + 0.125 * f2;
  const Mat1512 hg = half.lazyProduct(g);
  const Mat1512 weighted = hg * (density * dt_s).asDiagonal();

  const Mat15 phi_q = phi.lazyProduct(transition.q);
  transition.q = phi_q.lazyProduct(phi.transpose()) + weighted.lazyProduct(hg.transpose());
  const Mat15 chained = phi.lazyProduct(transition.phi);
  transition.phi = chained;
  if (!transition.with_scale) return;
  // A scale error is a bias that follows the reading, with the other sign.
  Eigen::Matrix<double, 6, 1> read;
  read << 0.5 * (interval.start.gyro_rad_s + interval.end.gyro_rad_s),
      0.5 * (interval.start.accel_m_s2 + interval.end.accel_m_s2);
  const Mat15 over_step = Mat15::Identity() + 0.5 * f + (1.0 / 6.0) * f2;
  const Mat156 by_reading = over_step.lazyProduct(f.block<15, 6>(0, at(kGyroBias)));
  const Mat156 carried = phi.lazyProduct(transition.by_scale);
  transition.by_scale = carried - by_reading * read.asDiagonal();
}

}  // namespace plumb
