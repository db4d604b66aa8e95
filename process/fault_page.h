#pragma once
// The faults of devices in words, for people.

#include <cstdint>
#include <span>
#include <string>

#include "fsw/events/device_faults.h"

namespace plumb {

/// All devices and counters by number, as a table.
std::string fault_page();

/// What a device had, in one line, with the last value where there is one; counters that stayed at zero are left out.
/// Precondition: a count for each of its texts.
std::string fault_line(FaultyDevice device, std::span<const FaultCounter> counts);

}  // namespace plumb
