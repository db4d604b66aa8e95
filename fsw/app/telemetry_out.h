#pragma once
// Hands the records of one thread to telemetry and log, each as its row of the table says.

#include "fsw/app/publisher.h"
#include "fsw/app/record_log.h"
#include "fsw/app/telemetry_table.h"

namespace plumb {

template <Thread kSender>
class TelemetryOut {
 public:
  /// Both must outlive this object.
  TelemetryOut(TelemetrySink& telemetry, LogSink& log) : publisher_(telemetry), log_(log) {}

  /// `t`: of the log.
  template <class Record>
  void send(Time t, const Record& record) {
    constexpr const TelemetryRow<Record>& kRow = kTelemetryRow<Record>;
    static_assert(kFlightSchedule[kRow.job].thread == kSender, "sent by a job of another thread than its row says");
    if constexpr (kRow.published) publisher_.publish(record);
    if constexpr (kRow.logged) log_.write(kRow.channel, t, record);
  }

 private:
  Publisher publisher_;
  RecordLog log_;
};

}  // namespace plumb
