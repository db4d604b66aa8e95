#include "process/host_check.h"

#include <unistd.h>

#include <filesystem>

#include "hal/linux/can_link.h"
#include "hal/linux/lcm_source.h"
#include "hal/linux/realtime_thread.h"

namespace plumb {
namespace {

void check_can(const FlightSetup& setup, const std::string& file, std::vector<std::string>& warnings) {
  if (setup.range.kind != RangeDevice::kCan || can_restart_delay_ms(setup.range.device) != 0U) return;
  warnings.push_back(file + ": key 'range.can': " + setup.range.device +
                     " stays off the bus once it is bus-off (restart-ms 0); expected that the system restarts it, " +
                     "as after: ip link set " + setup.range.device + " type can restart-ms 100");
}

}  // namespace

void check_host(const FlightSetup& setup, const std::string& file, std::vector<std::string>& faults,
                std::vector<std::string>& warnings) {
  if (!setup.lcm_url.empty() && !is_lcm_url(setup.lcm_url)) {
    faults.push_back(file + ": key 'lcm': '" + setup.lcm_url +
                     "' refused; expected a URL that LCM knows, such as udpm://239.255.76.67:7667?ttl=0");
  }
  for (std::size_t i = 0; i < setup.threads.size(); ++i) {
    const int core = setup.threads[i].core;
    if (core < 0 || may_run_on(core)) continue;
    warnings.push_back(file + ": key 'threads." + kFlightThreadNames[i] + ".core': " + std::to_string(core) +
                       " is no core that this process may run on; expected one of this computer, 0 to " +
                       std::to_string(cores_of_host() - 1) + ", or -1; it would fly on any");
  }
  check_can(setup, file, warnings);
}

void check_log_folder(const FlightSetup& setup, std::vector<std::string>& faults) {
  if (setup.log.empty()) return;
  const std::filesystem::path folder = std::filesystem::absolute(setup.log).parent_path();
  if (std::filesystem::is_directory(folder) && ::access(folder.c_str(), W_OK) == 0) return;
  faults.push_back("log: '" + setup.log + "' cannot be made; expected a folder " + folder.string() +
                   " that can be written to");
}

}  // namespace plumb
