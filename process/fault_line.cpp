#include "process/fault_line.h"

#include <cinttypes>
#include <cstdio>
#include <cstring>

namespace plumb {
namespace {

/// As it is read, with a blank and brackets; empty where there is none.
std::string told(FaultValue kind, std::int64_t value) {
  char text[64];
  const auto bits = static_cast<std::uint64_t>(value);
  switch (kind) {
    case FaultValue::kNone: return "";
    case FaultValue::kNumber: std::snprintf(text, sizeof text, " (last %" PRId64 ")", value); break;
    case FaultValue::kBits: std::snprintf(text, sizeof text, " (last 0x%" PRIx64 ")", bits); break;
    case FaultValue::kPair:
      std::snprintf(text, sizeof text, " (last %" PRIu64 " and %" PRIu64 ")", bits >> 32U, bits & 0xFFFF'FFFFU);
      break;
    case FaultValue::kSystemError:
      if (value == 0) return "";
      return " (last: " + std::string(std::strerror(static_cast<int>(value))) + ")";
  }
  return text;
}

}  // namespace

std::string fault_line(FaultyDevice device, std::span<const FaultCounter> counts) {
  const auto number = static_cast<std::size_t>(device);
  const std::span<const FaultRow> rows = kDeviceFaultTables[number];
  PLUMB_ASSERT(rows.size() == counts.size());
  std::string line;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (counts[i].count == 0) continue;
    line += (line.empty() ? "" : ", ") + std::string(rows[i].name) + " " + std::to_string(counts[i].count) +
            told(rows[i].value, counts[i].value);
  }
  return "faults of the " + std::string(kFaultyDeviceNames[number]) + ": " + (line.empty() ? "none" : line);
}

}  // namespace plumb
