#pragma once
// What the front end tells the estimator about one image: which features it sees, under lasting identities.

#include <cstdint>

#include "fsw/base/fixed_vector.h"
#include "fsw/base/time.h"

namespace plumb {

/// One feature seen in one image.
struct FeatureObservation {
  std::uint32_t track_id = 0;  ///< never reused within a run, so order of id is order of birth
  float u_px = 0.0F;           ///< distorted image column, px
  float v_px = 0.0F;           ///< distorted image row, px
  double x = 0.0;              ///< undistorted, normalised image plane z = 1 of camera C
  double y = 0.0;
};

/// All features of one image, in strictly increasing track_id. A track that is absent here has ended.
template <std::size_t MaxTracks>
struct FeatureFrame {
  Time t;                      ///< mid-exposure
  std::uint32_t sequence = 0;  ///< counts images, never the same twice within a run: observations find their pose by it
  FixedVector<FeatureObservation, MaxTracks> observations;
};

}  // namespace plumb
