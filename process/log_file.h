#pragma once
// The log of a flight: a file that never takes the place of another, and what stands at its beginning.

#include <memory>
#include <string>

#include "config/flight_config.h"
#include "hal/linux/lcm_log.h"

namespace plumb {

/// "flight.lcm", or where that is there already "flight-1.lcm" and so on.
std::string free_name(const std::string& name);

/// Writes configuration, calibration and parameters. kRejected: not all of it.
Status write_session(LcmLogWriter& log, const FlightSetup& setup, Time t);

}  // namespace plumb
