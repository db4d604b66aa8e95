#include "process/supervisor.h"

#include <algorithm>

namespace plumb {

Duration Supervisor::period() const {
  const Duration watchdog = manager_.watchdog();
  return watchdog <= Duration() ? kLongestLook : std::clamp(watchdog / 3, kShortestLook, kLongestLook);
}

std::vector<std::string> Supervisor::look() {
  std::vector<std::string> stuck;
  bool all_move = true;
  for (Watched& watched : watched_) {
    const std::uint64_t turns = board_.turns(watched.thread);
    if (turns == watched.turns) {
      stuck.emplace_back(kFlightThreadNames[static_cast<std::size_t>(watched.thread)]);
      all_move = all_move && !watched.must_move;
    }
    watched.turns = turns;
  }
  if (all_move) manager_.tell("WATCHDOG=1");
  return stuck;
}

}  // namespace plumb
