#pragma once
// Plays a recording out of interfaces, each message at its time, and keeps account of how well that went.

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "tools/hil/output.h"
#include "tools/hil/recording.h"

namespace plumb::hil {

/// How one interface did.
struct Account {
  std::uint64_t played = 0;
  std::uint64_t dropped = 0;  ///< the interface did not take it
  std::uint64_t invalid = 0;  ///< no message of its channel: nothing was played
  Duration lag_sum;           ///< behind the time that was wanted
  Duration lag_most;

  Duration lag_mean() const;
};

struct PlayReport {
  std::vector<Account> accounts;  ///< as the interfaces
  Duration recorded;              ///< length of what was played, by the recording's clock
  Duration taken;                 ///< by this host's
  bool interrupted = false;
};

/// `rate`: seconds of the recording in one of this host's.
PlayReport play(const std::string& file, const Contents& contents, const std::vector<std::unique_ptr<Output>>& outputs,
                double rate, const std::atomic<bool>& stop);

}  // namespace plumb::hil
