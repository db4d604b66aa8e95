// The named flights.

#include <numbers>

#include "test/support/sim/trajectory.h"

namespace plumb::sim {
namespace {

constexpr double kStand_s = 3.0;
constexpr double kClimb_s = 12.0;
constexpr double kSpeedUp_s = 4.0;
constexpr double kCruise_m_s = 2.0;  // paper, section VI-B
constexpr double kQuarterTurn = 0.5 * std::numbers::pi;

Trajectory stand_and_climb(const Vec3& ground_m, double height_m, double length_s) {
  Trajectory flight(ground_m, length_s);
  flight.lean(1.0).move(kStand_s, kClimb_s, {0.0, 0.0, height_m - ground_m.z()});
  return flight;
}

}  // namespace

Trajectory outdoor_cruise(const Vec3& ground_m, double height_m) {
  constexpr double kLength_s = 75.0;
  constexpr double kDeparture_s = kStand_s + kClimb_s;
  Trajectory flight = stand_and_climb(ground_m, height_m, kLength_s);
  flight.change_speed(kDeparture_s, kSpeedUp_s, {kCruise_m_s, 0.0, 0.0});
  flight.set_cruise(kDeparture_s + kSpeedUp_s, kLength_s);
  return flight;
}

Trajectory cruise_from_start(double height_m, double length_s) {
  // The change of speed lies before the first sample; at t = 0 the flight passes over the origin.
  const Vec3 velocity(kCruise_m_s, 0.0, 0.0);
  Trajectory flight(Vec3(0.0, 0.0, height_m) - 1.5 * velocity, length_s);
  flight.change_speed(-2.0, 1.0, velocity);
  flight.set_cruise(0.0, length_s);
  return flight;
}

Trajectory hover(const Vec3& ground_m, double height_m, double length_s) {
  return stand_and_climb(ground_m, height_m, length_s);
}

Trajectory excitation(const Vec3& ground_m, double height_m, double length_s) {
  Trajectory flight = stand_and_climb(ground_m, height_m, length_s);
  constexpr double kStart_s = kStand_s + kClimb_s;
  const double span_s = length_s - kStart_s;
  // Accelerations of 3 m/s^2: the body leans by up to 20 degrees.
  flight.oscillate(kStart_s, span_s, {0.8, 0.0, 0.0}, 0.0, 0.31)
      .oscillate(kStart_s, span_s, {0.0, 0.6, 0.0}, 0.0, 0.37, 0.7)
      .oscillate(kStart_s, span_s, {0.0, 0.0, 0.5}, 0.0, 0.23, 1.9)
      .oscillate(kStart_s, span_s, Vec3::Zero(), 0.6, 0.11, 0.3);
  flight.change_speed(kStart_s, kSpeedUp_s, {0.5, 0.2, 0.0});
  return flight;
}

Trajectory descent(double height_m, double length_s) {
  constexpr double kSpeed_m_s = 0.5;
  const Vec3 velocity(kSpeed_m_s, 0.0, -kSpeed_m_s);
  Trajectory flight(Vec3(0.0, 0.0, height_m) - 1.5 * velocity, length_s);
  flight.change_speed(-2.0, 1.0, velocity);
  flight.set_cruise(0.0, length_s);
  return flight;
}

Trajectory vertical_descent(double height_m, double length_s) {
  constexpr double kSpeed_m_s = 0.8;
  const Vec3 over_m(80.0, 0.0, height_m);  // the middle of the stepped ground
  const Vec3 velocity(0.0, 0.0, -kSpeed_m_s);
  Trajectory flight(over_m - 1.5 * velocity, length_s);
  flight.change_speed(-2.0, 1.0, velocity);
  flight.set_cruise(0.0, length_s);
  return flight;
}

Trajectory hand_held() {
  constexpr double kLength_s = 16.0;
  constexpr double kSpeedUp_s = 2.0;
  Trajectory flight(Vec3(0.0, 0.0, 1.5), kLength_s);
  flight.change_speed(kStand_s, kSpeedUp_s, Vec3::UnitX());
  flight.set_cruise(kStand_s + kSpeedUp_s, kLength_s);
  return flight;
}

Trajectory circuit(const Vec3& ground_m, double height_m) {
  constexpr double kLength_s = 80.0;
  constexpr double kTurn_s = 4.0;
  constexpr double kLeg_s = 14.0;
  Trajectory flight = stand_and_climb(ground_m, height_m, kLength_s);
  double t_s = kStand_s + kClimb_s;
  flight.change_speed(t_s, kTurn_s, {kCruise_m_s, 0.0, 0.0});
  const Vec3 directions[] = {Vec3::UnitX(), Vec3::UnitY(), -Vec3::UnitX(), -Vec3::UnitY()};
  for (int corner = 0; corner < 3; ++corner) {
    t_s += kLeg_s;
    flight.change_speed(t_s, kTurn_s, kCruise_m_s * (directions[corner + 1] - directions[corner]));
    flight.move(t_s, kTurn_s, Vec3::Zero(), kQuarterTurn);
  }
  flight.change_speed(kLength_s - 2.0 * kTurn_s, kTurn_s, -kCruise_m_s * directions[3]);
  return flight;
}

}  // namespace plumb::sim
