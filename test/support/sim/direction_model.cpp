#include "test/support/sim/direction_model.h"

#include <algorithm>

namespace plumb::sim {
namespace {

/// East, north, up: an afternoon sun 40 degrees above the horizon; the field of central Europe, 65 degrees downwards.
Vec3 known_direction(DirectionSource source) {
  return source == DirectionSource::kSun ? Vec3(-0.5, -0.58, 0.643).normalized()
                                         : Vec3(0.03, 0.42, -0.906).normalized();
}

}  // namespace

Quat east_of_world() { return so3_exp(Vec3(0.0, 0.0, kWorldHeading_rad)); }

DirectionSample DirectionModel::sample(const TruthState& truth, Time t) {
  const Vec3 known = known_direction(source_);
  const Vec3 right_I = (east_of_world() * truth.q_WI).conjugate() * known;
  const Vec3 error = noise_.noise_rad * random_.normal3();  // what is along the direction has no effect
  const Vec3 seen_I = so3_exp(error) * right_I;
  DirectionSample sample;
  sample.t = t;
  sample.source = source_;
  std::copy_n(seen_I.data(), 3, sample.seen_I.begin());
  std::copy_n(known.data(), 3, sample.known_W.begin());
  return sample;
}

}  // namespace plumb::sim
