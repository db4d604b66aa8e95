#pragma once
// The emulated unit on a real pseudo-terminal, in real time on CLOCK_MONOTONIC.

#include <mutex>
#include <thread>

#include "test/emulators/stim300/stim300_emulator.h"
#include "tools/hil/pseudo_terminal.h"

namespace plumb::emulator {

class Stim300OnPty {
 public:
  /// Switches the unit on now.
  Stim300OnPty(const Stim300Setup& setup, std::uint64_t seed);

  const std::string& device() const { return line_.device(); }
  /// Calls body(emulator) while the unit does nothing.
  template <typename Body>
  void with_unit(Body body) {
    const std::lock_guard lock(mutex_);
    body(unit_);
  }
  /// Pulls the plug; the unit is gone for good.
  void hang_up();
  static std::int64_t now_ns();

 private:
  void run(const std::stop_token& stop);
  void exchange();

  hil::PseudoTerminal line_;
  std::mutex mutex_;
  Stim300Emulator unit_;
  std::jthread thread_;  // last: it uses the others
};

}  // namespace plumb::emulator
