#pragma once
// The feature tracker that flies, for a mission configuration: constructed from CameraCalibration and TrackerOptions.
// A large object (two image pyramids), so it belongs in static storage, not on a stack.

#include <type_traits>

#include "fsw/base/mission_config.h"
#include "fsw/vision/feature_tracker.h"
#include "fsw/vision/flight_kernels.h"

namespace plumb {

template <class Config>
using FlightTracker =
    FeatureTracker<Config::kMaxTracks, FlightKernels<Config::kMaxImageWidth, Config::kMaxImageHeight>>;

extern template class FeatureTracker<FlightConfig::kMaxTracks,
                                     FlightKernels<FlightConfig::kMaxImageWidth, FlightConfig::kMaxImageHeight>>;
static_assert(std::is_same_v<FlightTracker<PaperConfig>, FlightTracker<FlightConfig>>,
              "one instantiation serves both configurations");

}  // namespace plumb
