#include "tools/hil/recording.h"

#include <algorithm>
#include <array>
#include <cstdio>

#include "config/input_error.h"
#include "fsw/telemetry/raw_messages.h"

namespace plumb::hil {
namespace {

constexpr std::array kDeviceChannels = {channel::kRawStim300, channel::kRawLidarLite, channel::kRawCan,
                                        channel::kCamera};

bool is_of_device(const std::string& name) {
  return std::any_of(kDeviceChannels.begin(), kDeviceChannels.end(),
                     [&name](const char* each) { return name == each; });
}

std::unique_ptr<LcmLogReader> open(const std::string& file) {
  std::string error;
  std::unique_ptr<LcmLogReader> log = LcmLogReader::open(file, error);
  if (log == nullptr) throw InputError(error);
  return log;
}

/// False at the end.
bool read(LcmLogReader& log, const std::string& file, LogEvent& event) {
  const Status status = log.next(event);
  if (status == Status::kInvalidValue) {
    throw InputError(file + ": is damaged after byte " + std::to_string(log.position()) +
                     "; expected an LCM event log");
  }
  return ok(status);
}

}  // namespace

Contents contents_of(const std::string& file) {
  const std::unique_ptr<LcmLogReader> log = open(file);
  Contents contents;
  bool is_calibrated = false;
  for (LogEvent event; read(*log, file, event);) {
    if (event.channel == channel::kCalibration) {
      SensorCalibration sensor;
      is_calibrated = ok(decode(event.message, contents.camera, sensor));
    }
    if (!is_of_device(event.channel)) continue;
    ++contents.messages[event.channel];
    contents.first = std::min(contents.first, event.t);
    contents.last = std::max(contents.last, event.t);
  }
  if (log->is_cut()) {
    std::fprintf(stderr, "plumb-hil: warning: %s: is cut short after byte %lld; played up to there\n", file.c_str(),
                 static_cast<long long>(log->position()));
  }
  if (!is_calibrated) throw InputError(file + ": has no CALIBRATION; expected a log of plumb-fsw or tools/simulate");
  if (contents.messages.empty()) {
    throw InputError(
        file + ": has nothing that a device said; expected channels RAW_STIM300, RAW_CAN, RAW_LIDAR_LITE or CAMERA");
  }
  return contents;
}

Recording::Recording(const std::string& file) : file_(file), log_(open(file)) {}

void Recording::read_ahead() {
  LogEvent event;
  while (!at_end_ && (waiting_.empty() || newest_ - waiting_.begin()->first < kMostDisorder)) {
    at_end_ = !read(*log_, file_, event);
    if (at_end_ || !is_of_device(event.channel)) continue;
    newest_ = std::max(newest_, event.t);
    waiting_.emplace(
        event.t, Said{.t = event.t, .channel = event.channel, .message = {event.message.begin(), event.message.end()}});
  }
}

bool Recording::next(Said& said) {
  read_ahead();
  if (waiting_.empty()) return false;
  said = std::move(waiting_.begin()->second);
  waiting_.erase(waiting_.begin());
  return true;
}

}  // namespace plumb::hil
