#pragma once
// The emulated range finder on a CAN interface of the system, in real time on CLOCK_MONOTONIC, by plain system calls.

#include <mutex>
#include <string>
#include <thread>

#include "test/emulators/can_range/can_range_emulator.h"

namespace plumb::test {

class CanRangeOnBus {
 public:
  /// Switches the unit on now. Throws std::runtime_error where there is no such interface.
  CanRangeOnBus(const std::string& interface_name, CanRangeEmulator::Kind kind, std::uint64_t seed);
  ~CanRangeOnBus();

  /// Calls body(emulator) while the unit does nothing.
  template <typename Body>
  void with_unit(Body body) {
    const std::lock_guard lock(mutex_);
    body(unit_);
  }
  /// What the controller of everybody on the bus says: bus-off, or back on it. A virtual interface has none, so nothing
  /// of the kind happens; it is told alone.
  void tell_bus_off(bool off);
  static std::int64_t now_ns();

 private:
  void run(const std::stop_token& stop);

  int socket_;
  std::mutex mutex_;
  CanRangeEmulator unit_;
  std::jthread thread_;  // last: it uses the others
};

}  // namespace plumb::test
