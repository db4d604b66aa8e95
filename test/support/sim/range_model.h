#pragma once
// A 1-D laser range finder on the rig, by ray casting.

#include "fsw/measurement/samples.h"
#include "test/support/sim/random.h"
#include "test/support/sim/rig.h"
#include "test/support/sim/world.h"

namespace plumb::sim {

struct RangeNoise {
  double noise_m = 0.025;       ///< 1 sigma, Lidar Lite v3 class
  double quantisation_m = 0.0;  ///< 0.01 as the device reports it; 0 for none
  double min_range_m = 0.05;
  double max_range_m = 40.0;
  double dropout = 0.0;  ///< probability of no return
  double outlier = 0.0;  ///< probability of an echo from something in between (uniform along the beam)

  /// What a filter should be told: white noise and quantisation together.
  double sigma_m() const;
};

class RangeModel {
 public:
  RangeModel(const RangeNoise& noise, std::uint64_t seed) : noise_(noise), random_(seed, kRangeStream) {}

  RangeSample sample(const World& world, const Rig& rig, const TruthState& truth, Time t);

 private:
  RangeNoise noise_;
  Random random_;
};

}  // namespace plumb::sim
