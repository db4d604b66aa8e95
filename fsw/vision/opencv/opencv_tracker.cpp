#include "fsw/vision/opencv/opencv_tracker.h"

#include "fsw/vision/feature_tracker_impl.h"

namespace plumb {

template class FeatureTracker<FlightConfig::kMaxTracks, OpenCvKernels>;

}  // namespace plumb
