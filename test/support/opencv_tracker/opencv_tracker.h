#pragma once
// The feature tracker on OpenCV's kernels, which the one that flies is compared with: constructed from
// CameraCalibration and TrackerOptions. Instantiated for the shipped mission configurations.

#include "fsw/base/mission_config.h"
#include "fsw/vision/feature_tracker.h"
#include "test/support/opencv_tracker/opencv_kernels.h"

namespace plumb {

template <std::size_t MaxTracks>
using OpenCvTracker = FeatureTracker<MaxTracks, OpenCvKernels>;

extern template class FeatureTracker<FlightConfig::kMaxTracks, OpenCvKernels>;
static_assert(PaperConfig::kMaxTracks == FlightConfig::kMaxTracks, "one instantiation serves both configurations");

}  // namespace plumb
