#pragma once
// Finds a patch of one image in another by Lucas-Kanade on pyramids (Bouguet 2000): from the coarsest level down, the
// patch of the first image keeps its gradients (Scharr), and the place in the second image moves until the difference
// of the two is no longer along them. What cv::calcOpticalFlowPyrLK does, to 0.05 px; unlike it, and where
// TrackerOptions::light_change says so, blind to what light adds to a patch and multiplies it with (flow_patch.h).
//
// Grey levels, gradients and their sums are integers, and so is the system that is solved: every sum is exact, whatever
// its order, so that vector units of any width give the same bits. What is not a sum is a double, in one order.
//
// Cost: points * (levels * (iterations + 3) + 4) * window * columns samples at most, each about 20 integer operations
// on 8 samples at once, or 16 with AVX2. Columns are 16 for windows up to 13 px, beyond that 24, or 32 with AVX2.

#include <cstddef>
#include <cstdint>

#include "fsw/measurement/samples.h"
#include "fsw/vision/image_kernels.h"
#include "fsw/vision/image_pyramid.h"
#include "fsw/vision/tracker_options.h"

namespace plumb {

class PatchFlow {
 public:
  /// Precondition: window, iterations, epsilon and smallest eigenvalue as TrackerOptions::check() accepts them.
  explicit PatchFlow(const TrackerOptions& options);

  /// One level: `from` and `to` have a margin of kImageMargin_px. Moves point.to, in pixels of this level, and sets
  /// point.found: false when the patch left either image or has too little texture; point.to is then where it was lost.
  /// The residual is left alone. A level that is not the finest is done with a longer step: the next one goes on.
  void refine(const ImageView& from, const ImageView& to, bool finest, FlowPoint& point) const;
  /// Mean absolute difference of the patch at from and at to, with light_change in the light of the first [grey
  /// levels]. Precondition: refine() found the point.
  float residual(const ImageView& from, const ImageView& to, const FlowPoint& point) const;

 private:
  template <std::size_t Columns>
  void refine_with(const ImageView& from, const ImageView& to, double last_step_px, FlowPoint& point) const;

  std::int32_t window_px_;
  std::int32_t max_iterations_;
  bool light_change_;
  double epsilon_px_;
  std::int64_t min_eigenvalue_;  ///< of the structure tensor, in its own unit
};

}  // namespace plumb
