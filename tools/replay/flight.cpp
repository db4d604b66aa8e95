#include "fsw/vision/flight_tracker.h"
#include "tools/replay/flight_impl.h"

namespace plumb::replay {

FlightTotals fly(Source& source, const FlightOptions& options, const std::vector<FlightListener*>& listeners) {
  return fly_by<FlightTracker>(source, options, listeners);
}

}  // namespace plumb::replay
