#pragma once
// The faults of devices in words, for people.

#include <cstdint>
#include <span>
#include <string>

#include "fsw/events/device_faults.h"

namespace plumb {

/// All devices and counters by number, as a table.
std::string fault_page();

/// What a device had, in one line, counters that stayed at zero left out. Precondition: a count for each of its texts.
std::string fault_line(FaultyDevice device, std::span<const std::uint64_t> counts);

}  // namespace plumb
