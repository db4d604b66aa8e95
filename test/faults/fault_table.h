#pragma once
// The faults of the flight, one row each.

#include <vector>

#include "test/faults/judge.h"

namespace plumb::faults {

std::vector<Fault> flight_faults();

}  // namespace plumb::faults
