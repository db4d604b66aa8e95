#pragma once
// The image kernels that fly (see image_kernels.h): static memory, bounded work, the same bits on every machine.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "fsw/vision/fast_corners.h"
#include "fsw/vision/image_kernels.h"
#include "fsw/vision/image_pyramid.h"
#include "fsw/vision/patch_flow.h"
#include "fsw/vision/tracker_options.h"

namespace plumb {

/// For images of at most MaxWidth x MaxHeight px.
template <std::size_t MaxWidth, std::size_t MaxHeight>
class FlightKernels {
 public:
  FlightKernels(const CameraCalibration&, const TrackerOptions& options)
      : levels_(options.levels), window_px_(options.window_px), flow_(options) {}

  void push(const ImageView& image) {
    present_ = 1 - present_;
    images_ = std::min(images_ + 1, 2);
    // A level smaller than the patch would only show the patch its own mirror image.
    pyramids_[present_].build(image, levels_, window_px_);
  }
  void forget() { images_ = 0; }
  ImageView present() const { return pyramids_[present_].level(0); }

  void follow(std::span<FlowPoint> points) const {
    for (FlowPoint& point : points) {
      point.found = false;
      if (images_ == 2) follow(pyramids_[1 - present_], pyramids_[present_], point);
    }
  }

  void detect(const TileRect& rect, std::int32_t threshold, CornerSink& sink) const {
    detect_fast_corners(present(), rect, threshold, sink);
  }

 private:
  using Pyramid = ImagePyramid<MaxWidth, MaxHeight, TrackerOptions::kMaxPyramidLevels>;

  // What a coarse level does not find is searched in the next finer one; the last word is that of the finest.
  void follow(const Pyramid& from, const Pyramid& to, FlowPoint& point) const {
    for (std::int32_t level = from.size() - 1; level >= 0; --level) {
      const auto size = static_cast<float>(1 << level);
      FlowPoint scaled{point.from_u_px / size, point.from_v_px / size, point.to_u_px / size, point.to_v_px / size};
      flow_.refine(from.level(level), to.level(level), level == 0, scaled);
      point.to_u_px = scaled.to_u_px * size;
      point.to_v_px = scaled.to_v_px * size;
      point.found = scaled.found;
    }
    if (point.found) point.residual = flow_.residual(from.level(0), to.level(0), point);
  }

  std::int32_t levels_;
  std::int32_t window_px_;
  PatchFlow flow_;
  std::array<Pyramid, 2> pyramids_;  ///< of the last two images
  std::size_t present_ = 0;          ///< which of them is the present one
  int images_ = 0;                   ///< how many of them hold an image
};

}  // namespace plumb
