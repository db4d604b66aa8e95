#include "fsw/vision/flight_tracker.h"

#include "fsw/vision/feature_tracker_impl.h"

namespace plumb {

template class FeatureTracker<FlightConfig::kMaxTracks,
                              FlightKernels<FlightConfig::kMaxImageWidth, FlightConfig::kMaxImageHeight>>;

}  // namespace plumb
