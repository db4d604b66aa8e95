// plumb-replay-opencv is plumb-replay with OpenCV's kernels in the tracker, for tracker_comparison.py.

#include <opencv2/core.hpp>

#include "test/support/opencv_tracker/opencv_tracker.h"
#include "tools/replay/flight_impl.h"

namespace plumb::replay {
namespace {

template <class Config>
using Tracker = OpenCvTracker<Config::kMaxTracks>;

}  // namespace

FlightTotals fly(Source& source, const FlightOptions& options, const std::vector<FlightListener*>& listeners) {
  cv::setNumThreads(1);
  return fly_by<Tracker>(source, options, listeners);
}

}  // namespace plumb::replay
