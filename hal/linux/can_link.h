#pragma once
// How the system has a CAN interface set up, as `ip -details link show can0` tells. Asking needs no rights; setting
// does.

#include <cstdint>
#include <optional>
#include <string>

namespace plumb {

/// How long after bus-off the system restarts the controller of the interface [ms]; 0: never by itself. Nothing where
/// there is no such interface, or none with a controller: a virtual one is never bus-off.
std::optional<std::uint32_t> can_restart_delay_ms(const std::string& interface_name);

}  // namespace plumb
