#include "test/support/opencv_tracker/opencv_tracker.h"

#include "fsw/vision/feature_tracker_impl.h"

namespace plumb {

template class FeatureTracker<FlightConfig::kMaxTracks, OpenCvKernels>;

}  // namespace plumb
