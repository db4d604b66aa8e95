#pragma once
// Random numbers that are the same bits with every standard library: mt19937_64 is fixed by the standard, the
// distributions of <random> are not, so they are written out here.

#include <cstdint>
#include <random>

#include "fsw/math/so3.h"

namespace plumb::sim {

class Random {
 public:
  /// Streams of one seed are independent of each other, so that one sensor's draws do not shift another's.
  Random(std::uint64_t seed, std::uint64_t stream);

  /// In [0, 1).
  double uniform();
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  /// Mean 0, standard deviation 1.
  double normal();
  Vec3 normal3();
  /// True with this probability. Draws even at 0 and 1, so that switching an effect on leaves the others' draws alone.
  bool chance(double probability) { return uniform() < probability; }

 private:
  std::mt19937_64 engine_;
  double spare_ = 0.0;
  bool has_spare_ = false;
};

/// The streams of one flight.
enum Stream : std::uint64_t {
  kImuStream = 1,
  kTrackerStream = 2,
  kRangeStream = 3,
  kCalibrationStream = 4,
  kDirectionStream = 5,  ///< and one more for each further source
};

}  // namespace plumb::sim
