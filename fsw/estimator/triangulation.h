#pragma once
// A feature from its track: bounded Gauss-Newton with step control on (alpha, beta, rho) in one camera of the track.

#include <cstddef>

#include "fsw/estimator/visual_model.h"

namespace plumb {

/// Longest track the filter uses at once; mission_config.h keeps windows within it.
inline constexpr std::size_t kMaxTrackLength = 32;

/// One view of a feature: where the camera was and where it saw it (normalised image plane).
struct View {
  CameraPose camera;
  Vec2 z = Vec2::Zero();
  std::size_t pose_slot = 0;
};
using Views = FixedVector<View, kMaxTrackLength>;

/// The depth of a track in one of its views, from a range: inverse depth along the optical axis there.
struct KnownDepth {
  std::size_t view = 0;
  double rho_1_m = 0.0;
  double sigma_1_m = 0.0;
  double weight = 0.0;  ///< sigma of an observation over sigma_1_m: what an error in rho counts among the observations
  Row5 by_beam = Row5::Zero();  ///< d rho / d (tilt, origin) of the beam (calibration.h); zero when it is not estimated
};

struct TriangulationLimits {
  double min_parallax = 0.01;  ///< normalised-plane extent of the rotation-free track
  double max_rms = 0.01;       ///< of the reprojection residual, normalised plane
  double min_depth_m = 0.05;
  double max_depth_m = 300.0;
};

/// Largest displacement of the track in the normalised plane of `anchor` after taking the rotation out.
double parallax(const Views& views, std::size_t anchor);

/// The feature in the camera of views[anchor]. kIllConditioned: too little parallax or no convergence;
/// kRejected: behind a camera, out of the depth limits, or residual too large. Precondition: 2 views or more.
/// With a known depth (may be null) no parallax is needed.
Result<FeatureParameters> triangulate(const Views& views, std::size_t anchor, const TriangulationLimits& limits,
                                      const KnownDepth* known = nullptr);

}  // namespace plumb
