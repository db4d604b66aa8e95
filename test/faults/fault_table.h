#pragma once
// The faults of the flight, one row each.

#include <vector>

#include "test/faults/judge.h"

namespace plumb::faults {

/// A sensor that is back is believed after a few samples, and looked at once a second.
inline constexpr double kBack_s = 1.0;

std::vector<Fault> flight_faults();

}  // namespace plumb::faults
