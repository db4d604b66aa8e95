#include "test/support/sim/range_model.h"

#include <cmath>

namespace plumb::sim {

double RangeNoise::sigma_m() const { return std::sqrt(noise_m * noise_m + quantisation_m * quantisation_m / 12.0); }

RangeSample RangeModel::sample(const World& world, const Rig& rig, const TruthState& truth, Time t) {
  // Every effect draws on every call, so that switching one on leaves the other draws as they were.
  const bool dropped = random_.chance(noise_.dropout);
  const bool outlier = random_.chance(noise_.outlier);
  const double share = random_.uniform();
  const double error_m = noise_.noise_m * random_.normal();

  RangeSample sample;
  sample.t = t;
  sample.quality = RangeQuality::kNoReturn;
  const std::optional<Hit> hit = world.cast(rig.beam_origin_m(truth), rig.beam_direction(truth), noise_.max_range_m);
  if (!hit || dropped) return sample;
  double range_m = (outlier ? share * hit->range_m : hit->range_m) + error_m;
  if (noise_.quantisation_m > 0.0) range_m = noise_.quantisation_m * std::round(range_m / noise_.quantisation_m);
  if (range_m < noise_.min_range_m || range_m > noise_.max_range_m) return sample;
  sample.range_m = range_m;
  sample.quality = RangeQuality::kValid;
  return sample;
}

}  // namespace plumb::sim
