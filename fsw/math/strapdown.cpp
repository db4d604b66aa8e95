#include "fsw/math/strapdown.h"

namespace plumb {

void strapdown_step(KinematicState& state, const InertialRates& start, const InertialRates& end, double dt_s,
                    double gravity_m_s2) {
  const Vec3& w0 = start.gyro_rad_s;
  const Vec3& w1 = end.gyro_rad_s;
  // Rotation vector over the interval, and over its first half, for a rate that is linear in time (Magnus series).
  const Vec3 coning = w0.cross(w1) * (dt_s * dt_s / 12.0);
  const Quat full = so3_exp(0.5 * (w0 + w1) * dt_s + coning);
  const Quat half = so3_exp((0.375 * w0 + 0.125 * w1) * dt_s + 0.125 * coning);

  const Vec3 f0 = state.q_WI * start.accel_m_s2;
  const Vec3 fm = state.q_WI * (half * (0.5 * (start.accel_m_s2 + end.accel_m_s2)));
  const Quat q1 = (state.q_WI * full).normalized();
  const Vec3 f1 = q1 * end.accel_m_s2;

  const Vec3 gravity(0.0, 0.0, -gravity_m_s2);
  const Vec3 dv = (f0 + 4.0 * fm + f1) * (dt_s / 6.0) + gravity * dt_s;
  const Vec3 dp = (f0 + 2.0 * fm) * (dt_s * dt_s / 6.0) + gravity * (0.5 * dt_s * dt_s);
  state.p_WI_m += state.v_WI_m_s * dt_s + dp;
  state.v_WI_m_s += dv;
  state.q_WI = q1;
}

}  // namespace plumb
