#pragma once
// What the tracker's logic and the code that works on pixels say to each other. A kernel class offers:
//
//   Kernels(const CameraCalibration&, const TrackerOptions&)
//   void push(const ImageView&)   the image becomes the present one, the present one the previous
//   void forget()                 there is no image any more
//   ImageView present() const     the present image; valid until the next push
//   void follow(std::span<FlowPoint>)
//                                 finds every point of the previous image in the present one, searching from `to`
//   void detect(const TileRect&, std::int32_t threshold, CornerSink&)
//                                 offers every corner of the present image inside the rectangle
//
// Each call is a function of its arguments and the last two images alone.

#include <cstddef>
#include <cstdint>

#include "fsw/vision/spacing_mask.h"
#include "fsw/vision/tiles.h"

namespace plumb {

struct FlowPoint {
  float from_u_px = 0.0F;
  float from_v_px = 0.0F;
  float to_u_px = 0.0F;  ///< in: where to start searching; out: where it was found
  float to_v_px = 0.0F;
  float residual = 0.0F;  ///< out: mean absolute difference of the patches [grey levels]
  bool found = false;     ///< out: false when the patch left the image or has no texture
};

inline constexpr std::size_t kCornersPerTile = 12;

/// Takes what a detector finds in one tile: counts everything and keeps the best corners that are far enough from the
/// live features.
class CornerSink {
 public:
  CornerSink(const SpacingMask& mask, BestCorners<kCornersPerTile>& best) : mask_(&mask), best_(&best) {}
  void offer(const Corner& corner) {
    ++offered_;
    if (!mask_->is_taken(corner.u_px, corner.v_px)) best_->offer(corner);
  }
  std::int32_t offered() const { return offered_; }

 private:
  const SpacingMask* mask_;
  BestCorners<kCornersPerTile>* best_;
  std::int32_t offered_ = 0;
};

}  // namespace plumb
