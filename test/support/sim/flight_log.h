#pragma once
// What a simulated flight leaves behind: one point per image, truth beside estimate.

#include <cstdint>
#include <vector>

#include "fsw/estimator/report.h"
#include "fsw/measurement/nav_state.h"
#include "test/support/sim/trajectory.h"

namespace plumb::sim {

struct FlightPoint {
  double t_s = 0.0;  ///< since the start of the trajectory
  TruthState truth;
  Vec3 gyro_bias_rad_s = Vec3::Zero();  ///< true
  Vec3 accel_bias_m_s2 = Vec3::Zero();
  NavState estimate;  ///< estimate.valid tells whether there is one
  FrameReport report;
  std::uint64_t state_hash = 0;
};

struct FlightLog {
  std::vector<FlightPoint> points;
  EstimatorCounters counters;
  double length_s = 0.0;
  double cruise_start_s = 0.0;  ///< the stretch scale is judged on; empty when end <= start
  double cruise_end_s = 0.0;
};

}  // namespace plumb::sim
