#pragma once
// Flights in closed form. Position and yaw are sums of elementary terms (smooth steps and windowed sines) whose
// derivatives are known, so acceleration and body rate are exact: nothing is differentiated numerically.

#include <array>
#include <vector>

#include "fsw/math/so3.h"

namespace plumb::sim {

/// A scalar function of time: value and first three derivatives.
using Jet = std::array<double, 4>;

/// 0 before x = 0, 1 after x = 1, four times continuously differentiable; derivatives with respect to x.
Jet smooth_step(double x);
/// Integral of smooth_step from 0 to x: 0 before 0, x - 1/2 after 1.
Jet smooth_step_integral(double x);

/// The true motion at one instant.
struct TruthState {
  Vec3 p_WI_m = Vec3::Zero();
  Vec3 v_WI_m_s = Vec3::Zero();
  Vec3 a_WI_m_s2 = Vec3::Zero();  ///< coordinate acceleration in W, without gravity
  Quat q_WI = Quat::Identity();
  Vec3 omega_I_rad_s = Vec3::Zero();  ///< rate of I with respect to W, in I
};

/// What a trajectory is made of. Vectors are positions in W [m]; `yaw` is the same in radians about the world vertical.
struct MotionTerm {
  enum class Kind { kMove, kSpeedChange, kOscillation };
  Kind kind = Kind::kMove;
  Vec3 amount = Vec3::Zero();  ///< move: m; speed change: m/s; oscillation: amplitude in m
  double yaw = 0.0;            ///< the same for yaw: rad, rad/s, rad
  double start_s = 0.0;
  double duration_s = 1.0;    ///< oscillation: from first to last motion, blends included
  double frequency_hz = 0.0;  ///< oscillation only
  double phase_rad = 0.0;
};

class Trajectory {
 public:
  Trajectory(const Vec3& start_m, double length_s) : start_m_(start_m), length_s_(length_s) {}

  /// A smooth displacement between two instants.
  Trajectory& move(double start_s, double duration_s, const Vec3& displacement_m, double yaw_rad = 0.0);
  /// A smooth change of velocity that lasts. Two of them make a turn.
  Trajectory& change_speed(double start_s, double duration_s, const Vec3& delta_v_m_s, double yaw_rate_rad_s = 0.0);
  /// A sine that swells up, stays and fades out within the span.
  Trajectory& oscillate(double start_s, double duration_s, const Vec3& amplitude_m, double yaw_rad, double frequency_hz,
                        double phase_rad = 0.0);
  /// How far the body's z axis leans into the acceleration: 0 stays level, 1 as a multirotor does.
  Trajectory& lean(double factor);
  /// The stretch at constant velocity on which scale is judged; none by default.
  Trajectory& set_cruise(double start_s, double end_s);

  TruthState at(double t_s) const;

  double length_s() const { return length_s_; }
  bool has_cruise() const { return cruise_end_s_ > cruise_start_s_; }
  double cruise_start_s() const { return cruise_start_s_; }
  double cruise_end_s() const { return cruise_end_s_; }

 private:
  Vec3 start_m_;
  double length_s_;
  double lean_ = 0.0;
  double cruise_start_s_ = 0.0;
  double cruise_end_s_ = 0.0;
  std::vector<MotionTerm> terms_;
};

/// Stands 3 s at `ground_m` (so that the camera is just above the ground), climbs to `height_m`, then flies straight
/// along x at 2 m/s: 75 s in all. Nothing excites it before or after.
Trajectory outdoor_cruise(const Vec3& ground_m, double height_m = 11.0);
/// 2 m/s along x from before the first sample on.
Trajectory cruise_from_start(double height_m = 11.0, double length_s = 75.0);
/// Stands, climbs, then holds its place, perfectly still.
Trajectory hover(const Vec3& ground_m, double height_m = 11.0, double length_s = 60.0);
/// Stands, climbs, then moves in all axes all the time.
Trajectory excitation(const Vec3& ground_m, double height_m = 6.0, double length_s = 60.0);
/// Already descending at constant 0.5 m/s, drifting forward at 0.5 m/s.
Trajectory descent(double height_m = 25.0, double length_s = 40.0);
/// Already descending at constant 0.8 m/s, straight down: 24 m to 4 m.
Trajectory vertical_descent(double height_m = 24.0, double length_s = 25.0);
/// Held still 1.5 m up, then 1 m/s along x: 12 m in 13 s.
Trajectory hand_held();
/// Stands, climbs, flies a rectangle with rounded corners, turning its nose into each leg.
Trajectory circuit(const Vec3& ground_m, double height_m = 8.0);

}  // namespace plumb::sim
