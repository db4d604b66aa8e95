#include "process/schedule_page.h"

#include <array>
#include <utility>

#include "fsw/app/flight_schedule.h"

namespace plumb {
namespace {

constexpr std::array<std::pair<DataSet, const char*>, 6> kRecords{{{flight_data::kSamples, "samples"},
                                                                   {flight_data::kInputFrame, "input frame"},
                                                                   {flight_data::kNavResult, "nav result"},
                                                                   {flight_data::kOutput, "output"},
                                                                   {flight_data::kTelemetry, "telemetry"},
                                                                   {flight_data::kHealthReport, "health report"}}};

std::string names(DataSet set) {
  std::string text;
  for (const auto& [record, name] : kRecords) {
    if ((set & record) != 0) text += (text.empty() ? "" : ", ") + std::string(name);
  }
  return text;
}

std::string milliseconds(Duration time) {
  std::string text = std::to_string(time.ns() / 1'000'000) + "." + std::to_string(time.ns() / 100'000 % 10);
  return text + " ms";
}

}  // namespace

std::string schedule_page() {
  std::string page =
      "| job | where | every | from tick | budget | result counts | reads | writes "
      "|\n|---|---|---|---|---|---|---|---|\n";
  for (const Job& job : kFlightSchedule) {
    page += "| " + std::string(job.name) + " | " + (job.thread == Thread::kTick ? "tick" : "own thread") + " | " +
            milliseconds(kTickPeriod * job.period_ticks) + " | " + std::to_string(job.offset_ticks) + " | " +
            milliseconds(job.budget) + " | " +
            (job.logical_ticks == 0 ? "in the tick" : "after " + std::to_string(job.logical_ticks) + " ticks") + " | " +
            names(job.inputs) + " | " + names(job.outputs) + " |\n";
  }
  return page;
}

}  // namespace plumb
