#include "process/fault_page.h"

namespace plumb {
namespace {

std::string name_of(FaultyDevice device) { return std::string(kFaultyDeviceNames[static_cast<std::size_t>(device)]); }

std::string rows(FaultyDevice device, std::span<const FaultText> texts) {
  std::string rows;
  for (std::size_t i = 0; i < texts.size(); ++i) {
    rows += "| " + std::to_string(static_cast<int>(device)) + " " + name_of(device) + " | " + std::to_string(i) + " | `" +
            std::string(texts[i].name) + "` | " + std::string(texts[i].meaning) + " |\n";
  }
  return rows;
}

}  // namespace

std::string fault_page() {
  return "| device | counter | name | what it counts |\n|---|---|---|---|\n" +
         rows(FaultyDevice::kStim300, kStim300Faults) + rows(FaultyDevice::kCamera, kCameraFaults) +
         rows(FaultyDevice::kLidarLite, kLidarLiteFaults) + rows(FaultyDevice::kCanRange, kCanRangeFaults) +
         rows(FaultyDevice::kLog, kLogFaults);
}

std::string fault_line(FaultyDevice device, std::span<const FaultText> texts, std::span<const std::uint64_t> counts) {
  PLUMB_ASSERT(texts.size() == counts.size());
  std::string line;
  for (std::size_t i = 0; i < texts.size(); ++i) {
    if (counts[i] == 0) continue;
    line += (line.empty() ? "" : ", ") + std::string(texts[i].name) + " " + std::to_string(counts[i]);
  }
  return "faults of the " + name_of(device) + ": " + (line.empty() ? "none" : line);
}

}  // namespace plumb
