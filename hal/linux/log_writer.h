#pragma once
// Takes what the flight threads have queued to the log file.

#include <cstdint>
#include <span>
#include <vector>

#include "fsw/base/fault_counter.h"
#include "hal/include/log_sink.h"
#include "hal/include/queued_log.h"

namespace plumb {

class LogWriter {
 public:
  /// Room for one message of any kind; an image is the largest.
  static constexpr std::size_t kMaxRecordBytes = std::size_t{512} << 10;

  /// `last`: the queue whose records refer to those of the others, that is, the tick's. All must outlive the writer.
  LogWriter(LogSink& file, std::vector<QueuedLog*> first, QueuedLog& last);

  /// Writes what is there. A record that somebody queued before he let the tick task know of it is in the file before
  /// the tick's record that uses it: what is in the tick's queue is looked at first and written last.
  void drain(Time now);

  std::uint64_t written() const { return written_; }
  /// Records that their queue had no room for.
  std::uint64_t dropped() const;
  /// Records that the file did not take. Value: the system's reason (errno).
  FaultCounter refused() const { return {refused_, file_.last_error()}; }

 private:
  struct Queue {
    QueuedLog* log;
    std::uint64_t end = 0;
    std::uint64_t told = 0;  ///< drops that the file tells of
  };
  void write_until_end(Queue& queue, Time now);
  void write(const char* channel, Time t, std::span<const std::uint8_t> bytes);

  LogSink& file_;
  std::vector<Queue> queues_;  ///< the last one is the tick's
  std::vector<std::uint8_t> room_;
  std::uint64_t written_ = 0;
  std::uint64_t refused_ = 0;
};

}  // namespace plumb
