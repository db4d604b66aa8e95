#include "test/support/sim/trajectory.h"

#include <cmath>
#include <numbers>

namespace plumb::sim {
namespace {

constexpr double kGravity_m_s2 = 9.80665;  // for the lean only; what the IMU feels is the IMU model's business
constexpr double kBlendShare = 0.2;        // of an oscillation's span, at each end

/// d/dt of f((t - t0) / T) from d/dx.
Jet stretch(const Jet& f, double duration_s) {
  const double k = 1.0 / duration_s;
  return {f[0], f[1] * k, f[2] * k * k, f[3] * k * k * k};
}

/// Leibniz's rule to third order.
Jet product(const Jet& f, const Jet& g) {
  return {f[0] * g[0], f[1] * g[0] + f[0] * g[1], f[2] * g[0] + 2.0 * f[1] * g[1] + f[0] * g[2],
          f[3] * g[0] + 3.0 * f[2] * g[1] + 3.0 * f[1] * g[2] + f[0] * g[3]};
}

Jet windowed_sine(const MotionTerm& term, double t_s) {
  const double blend_s = kBlendShare * term.duration_s;
  const double end_s = term.start_s + term.duration_s;
  const Jet rise = stretch(smooth_step((t_s - term.start_s) / blend_s), blend_s);
  Jet fall = stretch(smooth_step((t_s - end_s + blend_s) / blend_s), blend_s);
  fall = {1.0 - fall[0], -fall[1], -fall[2], -fall[3]};
  const double w = 2.0 * std::numbers::pi * term.frequency_hz;
  const double angle = w * (t_s - term.start_s) + term.phase_rad;
  const double s = std::sin(angle);
  const double c = std::cos(angle);
  return product(product(rise, fall), {s, w * c, -w * w * s, -w * w * w * c});
}

Jet evaluate(const MotionTerm& term, double t_s) {
  const double x = (t_s - term.start_s) / term.duration_s;
  switch (term.kind) {
    case MotionTerm::Kind::kMove: return stretch(smooth_step(x), term.duration_s);
    case MotionTerm::Kind::kSpeedChange: {
      Jet f = stretch(smooth_step_integral(x), term.duration_s);
      for (double& value : f) value *= term.duration_s;
      return f;
    }
    case MotionTerm::Kind::kOscillation: return windowed_sine(term, t_s);
  }
  return {};
}

/// Attitude whose z axis is the shortest turn away from the vertical to `thrust`, then turned by yaw about that axis;
/// the rate follows from the derivative of the unnormalised quaternion (1 + z, -y, x, 0).
void set_attitude(const Vec3& thrust, const Vec3& thrust_rate, double yaw, double yaw_rate, TruthState& truth) {
  const double norm = thrust.norm();
  const Vec3 z = thrust / norm;
  const Vec3 z_rate = (thrust_rate - z * z.dot(thrust_rate)) / norm;
  const Quat tilt(1.0 + z.z(), -z.y(), z.x(), 0.0);
  const Quat tilt_rate(z_rate.z(), -z_rate.y(), z_rate.x(), 0.0);
  const Vec3 omega_tilt = 2.0 / tilt.squaredNorm() * (tilt.conjugate() * tilt_rate).vec();
  const Quat heading(Eigen::AngleAxisd(yaw, Vec3::UnitZ()));
  truth.q_WI = tilt.normalized() * heading;
  truth.omega_I_rad_s = heading.conjugate() * omega_tilt + yaw_rate * Vec3::UnitZ();
}

}  // namespace

Jet smooth_step(double x) {
  if (x <= 0.0) return {0.0, 0.0, 0.0, 0.0};
  if (x >= 1.0) return {1.0, 0.0, 0.0, 0.0};
  const double x2 = x * x;
  const double x3 = x2 * x;
  const double y = 1.0 - x;
  return {x3 * x2 * (126.0 + x * (-420.0 + x * (540.0 + x * (-315.0 + x * 70.0)))), 630.0 * x2 * x2 * y * y * y * y,
          2520.0 * x3 * y * y * y * (1.0 - 2.0 * x), 2520.0 * x2 * y * y * (3.0 - 14.0 * x + 14.0 * x2)};
}

Jet smooth_step_integral(double x) {
  const Jet step = smooth_step(x);
  if (x <= 0.0) return {0.0, step[0], step[1], step[2]};
  if (x >= 1.0) return {x - 0.5, step[0], step[1], step[2]};
  const double x2 = x * x;
  const double integral = x2 * x2 * x2 * (21.0 + x * (-60.0 + x * (67.5 + x * (-35.0 + x * 7.0))));
  return {integral, step[0], step[1], step[2]};
}

Trajectory& Trajectory::move(double start_s, double duration_s, const Vec3& displacement_m, double yaw_rad) {
  terms_.push_back({MotionTerm::Kind::kMove, displacement_m, yaw_rad, start_s, duration_s, 0.0, 0.0});
  return *this;
}

Trajectory& Trajectory::change_speed(double start_s, double duration_s, const Vec3& delta_v_m_s,
                                     double yaw_rate_rad_s) {
  terms_.push_back({MotionTerm::Kind::kSpeedChange, delta_v_m_s, yaw_rate_rad_s, start_s, duration_s, 0.0, 0.0});
  return *this;
}

Trajectory& Trajectory::oscillate(double start_s, double duration_s, const Vec3& amplitude_m, double yaw_rad,
                                  double frequency_hz, double phase_rad) {
  terms_.push_back(
      {MotionTerm::Kind::kOscillation, amplitude_m, yaw_rad, start_s, duration_s, frequency_hz, phase_rad});
  return *this;
}

Trajectory& Trajectory::lean(double factor) {
  lean_ = factor;
  return *this;
}

Trajectory& Trajectory::set_cruise(double start_s, double end_s) {
  cruise_start_s_ = start_s;
  cruise_end_s_ = end_s;
  return *this;
}

TruthState Trajectory::at(double t_s) const {
  TruthState truth;
  truth.p_WI_m = start_m_;
  Vec3 jerk = Vec3::Zero();
  double yaw = 0.0;
  double yaw_rate = 0.0;
  for (const MotionTerm& term : terms_) {
    const Jet f = evaluate(term, t_s);
    truth.p_WI_m += f[0] * term.amount;
    truth.v_WI_m_s += f[1] * term.amount;
    truth.a_WI_m_s2 += f[2] * term.amount;
    jerk += f[3] * term.amount;
    yaw += f[0] * term.yaw;
    yaw_rate += f[1] * term.yaw;
  }
  const Vec3 thrust = kGravity_m_s2 * Vec3::UnitZ() + lean_ * truth.a_WI_m_s2;
  set_attitude(thrust, lean_ * jerk, yaw, yaw_rate, truth);
  return truth;
}

}  // namespace plumb::sim
