#pragma once
// A sun sensor and a magnetometer on the rig.

#include "fsw/measurement/samples.h"
#include "test/support/sim/random.h"
#include "test/support/sim/trajectory.h"

namespace plumb::sim {

struct DirectionNoise {
  double rate_hz = 0.0;  ///< 0: there is no such sensor
  double noise_rad = 0.0;
};

/// Where east is: the simulated world's x axis points this much to the left of it, so that a filter that takes its own
/// start for east is wrong.
inline constexpr double kWorldHeading_rad = 0.7;

/// From the simulated world to one with x east, y north.
Quat east_of_world();

class DirectionModel {
 public:
  DirectionModel(const DirectionNoise& noise, DirectionSource source, std::uint64_t seed)
      : noise_(noise), source_(source), random_(seed, kDirectionStream + static_cast<std::uint64_t>(source)) {}

  DirectionSample sample(const TruthState& truth, Time t);

 private:
  DirectionNoise noise_;
  DirectionSource source_;
  Random random_;
};

}  // namespace plumb::sim
