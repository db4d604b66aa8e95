#include "process/telemetry_page.h"

#include "fsw/app/telemetry_table.h"

namespace plumb {
namespace {

std::string words_of(SentWhen when, const Job& job) {
  switch (when) {
    case SentWhen::kEachRun:
      return "every " + std::to_string((kTickPeriod * job.period_ticks).ns() / 1'000'000) + " ms";
    case SentWhen::kEachSample: return "each IMU sample";
    case SentWhen::kEachImage: return "each processed image";
    case SentWhen::kOnChange: return "on change";
    case SentWhen::kOnCommand: return "on command";
  }
  return "";
}

std::string row_of(const SentRecord& sent) {
  const Job& job = kFlightSchedule[sent.job];
  return "| `" + std::string(sent.channel) + "` | `" + std::string(sent.type) + "` | " + words_of(sent.when, job) +
         " | " + std::string(job.name) + " | " + (sent.published ? "yes" : "no") + " | " +
         (sent.logged ? "yes" : "no") + " |\n";
}

}  // namespace

std::string telemetry_page() {
  std::string page = "| channel | type | sent | by job | telemetry | log |\n|---|---|---|---|---|---|\n";
  for_each_telemetry_row([&page](const SentRecord& sent) { page += row_of(sent); });
  return page;
}

}  // namespace plumb
