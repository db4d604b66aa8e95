#pragma once
// LCM event logs, as lcm-logger writes and lcm-logplayer reads them.

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "hal/include/log_sink.h"

typedef struct _lcm_eventlog_t lcm_eventlog_t;
typedef struct _lcm_eventlog_event_t lcm_eventlog_event_t;

namespace plumb {

class LcmLogWriter final : public LogSink {
 public:
  /// Creates or empties the file. Null, and the reason in `error`, when that is not possible.
  static std::unique_ptr<LcmLogWriter> open(const std::string& file, std::string& error);
  ~LcmLogWriter() override;
  LcmLogWriter(const LcmLogWriter&) = delete;
  LcmLogWriter& operator=(const LcmLogWriter&) = delete;

  /// The event carries the time in whole microseconds, so that a player keeps the pace of the recording. Nothing is
  /// written any more once something could not be: the file is then whole up to there.
  Status write(const char* channel, Time t, std::span<const std::uint8_t> message) override;
  /// Hands everything to the operating system. kRejected: not all of it could be written.
  Status flush();
  /// Of the first write that failed, which is the last one that was tried.
  int last_error() const override { return last_error_; }

 private:
  explicit LcmLogWriter(lcm_eventlog_t* log) : log_(log) {}
  Status failed();
  lcm_eventlog_t* log_;
  int last_error_ = 0;
};

/// One message of a log. Valid until the next read.
struct LogEvent {
  std::string channel;
  Time t;  ///< in whole microseconds
  std::span<const std::uint8_t> message;
};

class LcmLogReader {
 public:
  /// Null, and the reason in `error`, when the file cannot be read.
  static std::unique_ptr<LcmLogReader> open(const std::string& file, std::string& error);
  ~LcmLogReader();
  LcmLogReader(const LcmLogReader&) = delete;
  LcmLogReader& operator=(const LcmLogReader&) = delete;

  /// kNotReady at the end of the log, kInvalidValue where it is damaged (see position()).
  Status next(LogEvent& event);
  /// At the end: whether a piece of an event follows, as where its writer was killed or its disk was full.
  bool is_cut() const { return is_cut_; }
  /// Bytes read as whole events.
  std::int64_t position() const { return position_; }

 private:
  explicit LcmLogReader(lcm_eventlog_t* log);
  bool is_piece_left() const;

  lcm_eventlog_t* log_;
  lcm_eventlog_event_t* event_ = nullptr;
  std::int64_t size_ = 0;
  std::int64_t position_ = 0;
  bool is_cut_ = false;
};

}  // namespace plumb
