#pragma once
// FAST-9 corners (Rosten and Drummond 2006): pixels on whose surrounding circle of 16 pixels (radius 3) at least 9
// neighbouring ones are all brighter or all darker than the centre by more than a threshold. The score of a corner is
// the largest threshold at which it still is one; of touching corners only a strict maximum of the score is kept. The
// corners and scores are those of cv::FAST with suppression.
//
// Cost: at most pixels * 170 / 16 vector operations, which is where there is texture everywhere, and at most one corner
// in four pixels.

#include <cstdint>

#include "fsw/measurement/samples.h"
#include "fsw/vision/image_kernels.h"

namespace plumb {

/// Offers every corner inside the rectangle, row by row from the left. Corners outside do not suppress corners inside.
/// Precondition: `image` has a margin of kImageMargin_px, of which nothing but the memory is used if the rectangle
/// stays 3 px away from the edges; 1 <= threshold <= 255.
void detect_fast_corners(const ImageView& image, const TileRect& rect, std::int32_t threshold, CornerSink& sink);

}  // namespace plumb
