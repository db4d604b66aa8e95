#include "fsw/telemetry/executive_messages.h"

#include <algorithm>

#include "fsw/telemetry/lcm_codec.h"
#include "plumb_lcm/plumb/event_t.hpp"
#include "plumb_lcm/plumb/log_gap_t.hpp"
#include "plumb_lcm/plumb/schedule_t.hpp"

namespace plumb {
namespace {

template <std::size_t N>
void copy(std::string_view from, std::uint8_t (&to)[N]) {
  std::copy_n(from.begin(), std::min(from.size(), N - 1), to);
}

}  // namespace

Result<std::size_t> encode(const LogGap& gap, MessageBuffer buffer) {
  log_gap_t message{};
  message.time_ns = gap.t.ns();
  copy(gap.queue, message.queue);
  message.records = static_cast<std::int64_t>(gap.records);
  return write(message, buffer);
}

Result<std::size_t> encode(const Event& event, MessageBuffer buffer) {
  event_t message{};
  message.time_ns = event.t.ns();
  message.id = static_cast<std::int16_t>(event.id);
  message.severity = static_cast<std::int8_t>(event.severity);
  std::copy(event.arguments.begin(), event.arguments.end(), message.arguments);
  return write(message, buffer);
}

Result<std::size_t> encode(const ScheduleRecord& schedule, MessageBuffer buffer) {
  schedule_t message{};
  static_assert(std::size(decltype(message.jobs){}) == kMaxJobs, "navigation.lcm has room for every job");
  message.time_ns = schedule.t.ns();
  message.imu_samples = static_cast<std::int64_t>(schedule.imu_latency.count);
  message.imu_latency_median_ns = schedule.imu_latency.median.ns();
  message.imu_latency_999_ns = schedule.imu_latency.permille_999.ns();
  message.imu_latency_max_ns = schedule.imu_latency.max.ns();
  message.count = static_cast<std::int32_t>(schedule.jobs.size());
  for (std::size_t i = 0; i < schedule.jobs.size(); ++i) {
    const JobRecord& job = schedule.jobs[i];
    job_t& row = message.jobs[i];
    copy(job.name, row.name);
    row.runs = static_cast<std::int64_t>(job.account.runs());
    row.overruns = static_cast<std::int64_t>(job.account.overruns());
    row.slips = static_cast<std::int64_t>(job.account.slips());
    row.budget_ns = job.budget.ns();
    row.last_ns = job.account.last().ns();
    row.mean_ns = job.account.mean().ns();
    row.max_ns = job.account.max().ns();
  }
  return write(message, buffer);
}

}  // namespace plumb
