#pragma once
// What the executive tells of itself, as LCM messages. As messages.h.

#include <cstdint>
#include <string_view>

#include "fsw/base/fixed_vector.h"
#include "fsw/events/event.h"
#include "fsw/schedule/job_account.h"
#include "fsw/telemetry/messages.h"

namespace plumb {

namespace channel {
inline constexpr const char* kConfig = "CONFIG";
inline constexpr const char* kLogGap = "LOG_GAP";
inline constexpr const char* kSchedule = "SCHEDULE";
inline constexpr const char* kEvents = "EVENTS";
}  // namespace channel

struct LogGap {
  Time t;                     ///< when it was seen; the records belong before it
  std::string_view queue;     ///< whose records, at most 15 characters
  std::uint64_t records = 0;  ///< that did not get into the log
};

/// One job of the schedule. `name` is that of its row.
struct JobRecord {
  std::string_view name;
  Duration budget;
  JobAccount account;
};

inline constexpr std::size_t kMaxJobs = 8;

/// How long something took since start-up, to 3 %.
struct LatencyRecord {
  std::uint64_t count = 0;
  Duration median;
  Duration permille_999;  ///< 99.9 % took no longer
  Duration max;
};

struct ScheduleRecord {
  Time t;
  LatencyRecord imu_latency;  ///< from the arrival of an IMU sample to the output of its tick
  FixedVector<JobRecord, kMaxJobs> jobs;
};

Result<std::size_t> encode(const LogGap& gap, MessageBuffer buffer);
Result<std::size_t> encode(const Event& event, MessageBuffer buffer);
Result<std::size_t> encode(const ScheduleRecord& schedule, MessageBuffer buffer);

}  // namespace plumb
