#pragma once
// Whether every thread gets round, and word of it to the system's service manager, which starts a process again that
// does not.

#include <array>
#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "config/flight_config.h"
#include "hal/linux/service_manager.h"

namespace plumb {

/// A count for each thread, kept by the thread itself.
class ProgressBoard {
 public:
  /// Its thread, at the end of each turn.
  void moved(FlightThread key) { of(key).store(turns(key) + 1, std::memory_order_relaxed); }
  std::uint64_t turns(FlightThread key) const {
    return turns_[static_cast<std::size_t>(key)].load(std::memory_order_relaxed);
  }

 private:
  std::atomic<std::uint64_t>& of(FlightThread key) { return turns_[static_cast<std::size_t>(key)]; }
  std::array<std::atomic<std::uint64_t>, kFlightThreadNames.size()> turns_{};
};

class Supervisor {
 public:
  /// The shortest time between two looks: longer than any thread waits for its device.
  static constexpr Duration kShortestLook = Duration::from_ms(300);
  static constexpr Duration kLongestLook = Duration::from_ms(1000);

  /// Both must outlive it.
  Supervisor(const ProgressBoard& board, ServiceManager& manager) : board_(board), manager_(manager) {}

  /// From here on the watchdog is stroked only while this thread gets round.
  void watch(FlightThread thread) { watched_.push_back({thread, board_.turns(thread), true}); }
  /// From here on it is told when this thread does not get round, and no more than that.
  void look_after(FlightThread thread) { watched_.push_back({thread, board_.turns(thread), false}); }
  /// How long to wait from look to look: three are within the watchdog's time.
  Duration period() const;
  /// Strokes the watchdog if every thread that is watched has moved since the last look. All that have not.
  std::vector<std::string> look();

 private:
  struct Watched {
    FlightThread thread;
    std::uint64_t turns;
    bool must_move;
  };
  const ProgressBoard& board_;
  ServiceManager& manager_;
  std::vector<Watched> watched_;
};

}  // namespace plumb
