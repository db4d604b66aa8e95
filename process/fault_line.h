#pragma once
// The faults of devices in words, for people.

#include <cstdint>
#include <span>
#include <string>

#include "fsw/events/device_faults.h"

namespace plumb {

/// What a device had, in one line, with the last value where there is one; counters that stayed at zero are left out.
/// Precondition: a count for each of its rows.
std::string fault_line(FaultyDevice device, std::span<const FaultCounter> counts);

}  // namespace plumb
