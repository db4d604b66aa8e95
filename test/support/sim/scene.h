#pragma once
// A flight without an estimator: where it goes, over what, with which sensors; and the settings those sensors imply.

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "fsw/estimator/options.h"
#include "test/support/sim/direction_model.h"
#include "test/support/sim/imu_model.h"
#include "test/support/sim/landmark_tracker.h"
#include "test/support/sim/range_model.h"
#include "test/support/sim/rig.h"
#include "test/support/sim/trajectory.h"
#include "test/support/sim/world.h"

namespace plumb::sim {

struct Scene {
  std::string name;
  Trajectory trajectory;
  World world;
  Rig rig;
  World (*world_of)(std::uint64_t seed) = nullptr;  ///< each flight over the ground of its seed: where few spots decide
  double gravity_m_s2 = 9.80665;
};

/// Names make_scene() knows, in the order of a full report.
std::span<const std::string_view> scene_names();
/// Throws std::invalid_argument, naming the scene, when there is none of that name.
Scene make_scene(std::string_view name);

struct FlightSettings {
  ImuNoise imu = stim300_class();
  RangeNoise range;
  TrackerOptions tracker;
  DirectionNoise sun;
  DirectionNoise magnetometer;
  double imu_rate_hz = 250.0;
  double image_rate_hz = 30.0;
  double range_rate_hz = 25.0;
  double image_time_offset_s = 0.0;  ///< an image is taken this much after its stamp
  std::uint64_t seed = 1;
  bool start_from_truth = false;  ///< hands the true state to the estimator instead of letting it find its own
};

/// Estimator settings that tell the filter the simulation's own noise figures; everything else as shipped, gravity
/// among it.
EstimatorOptions matched_options(const FlightSettings& settings);

}  // namespace plumb::sim
