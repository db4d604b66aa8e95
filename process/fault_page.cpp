#include "process/fault_page.h"

namespace plumb {

std::string fault_page() {
  std::string page = "| device | counter | name | what it counts |\n|---|---|---|---|\n";
  for (std::size_t device = 0; device < kDeviceFaultTables.size(); ++device) {
    for (std::size_t i = 0; i < kDeviceFaultTables[device].size(); ++i) {
      const FaultText& text = kDeviceFaultTables[device][i];
      page += "| " + std::to_string(device) + " " + std::string(kFaultyDeviceNames[device]) + " | " +
              std::to_string(i) + " | `" + std::string(text.name) + "` | " + std::string(text.meaning) + " |\n";
    }
  }
  return page;
}

std::string fault_line(FaultyDevice device, std::span<const std::uint64_t> counts) {
  const auto number = static_cast<std::size_t>(device);
  const std::span<const FaultText> texts = kDeviceFaultTables[number];
  PLUMB_ASSERT(texts.size() == counts.size());
  std::string line;
  for (std::size_t i = 0; i < texts.size(); ++i) {
    if (counts[i] == 0) continue;
    line += (line.empty() ? "" : ", ") + std::string(texts[i].name) + " " + std::to_string(counts[i]);
  }
  return "faults of the " + std::string(kFaultyDeviceNames[number]) + ": " + (line.empty() ? "none" : line);
}

}  // namespace plumb
