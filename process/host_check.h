#pragma once
// What of a configuration depends on the computer that flies by it, so that it cannot be seen from the file alone.

#include <string>
#include <vector>

#include "config/flight_config.h"

namespace plumb {

/// What nothing can fly with goes to `faults`, what would be done without in flight to `warnings`; each names `file`,
/// key, value and what was expected.
void check_host(const FlightSetup& setup, const std::string& file, std::vector<std::string>& faults,
                std::vector<std::string>& warnings);

/// Whether a log could be made, without making one: a flight that starts finds out by itself.
void check_log_folder(const FlightSetup& setup, std::vector<std::string>& faults);

}  // namespace plumb
