#pragma once
// The section `range` of the configuration of plumb-fsw: which range finder, how to speak with it, and where its beam
// is.

#include "config/flight_config.h"
#include "config/section.h"

namespace plumb {

/// Into the setup's range, calibration and parameters.
void read_range_section(const YamlFile& yaml, FlightSetup& setup, const Steps& steps);

}  // namespace plumb
