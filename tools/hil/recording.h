#pragma once
// A recorded flight as what its devices said, in the order of time.

#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "fsw/telemetry/messages.h"
#include "hal/linux/lcm_log.h"

namespace plumb::hil {

/// What one device said at once.
struct Said {
  Time t;  ///< when the host had it
  std::string channel;
  std::vector<std::uint8_t> message;
};

/// What is in a log, known before any of it is played.
struct Contents {
  std::map<std::string, std::size_t> messages;  ///< of each channel of a device
  Time first = Time::max();                     ///< of all of them
  Time last = Time::never();
  CameraCalibration camera;
};

/// Reads the whole log once. Throws InputError where it is no whole log of a flight.
Contents contents_of(const std::string& file);

class Recording {
 public:
  /// As contents_of().
  explicit Recording(const std::string& file);
  /// The next in time; false at the end.
  bool next(Said& said);

 private:
  // Each thread of plumb-fsw has a queue to the log, of some tenths of a second; they are emptied one after the other.
  static constexpr Duration kMostDisorder = Duration::from_ms(2000);

  void read_ahead();

  std::string file_;
  std::unique_ptr<LcmLogReader> log_;
  std::multimap<Time, Said> waiting_;
  Time newest_ = Time::never();
  bool at_end_ = false;
};

}  // namespace plumb::hil
