#include "test/emulators/stim300/stim300_on_pty.h"

#include <chrono>

namespace plumb::emulator {

Stim300OnPty::Stim300OnPty(const Stim300Setup& setup, std::uint64_t seed)
    : unit_(setup, now_ns(), seed), thread_([this](const std::stop_token& stop) { run(stop); }) {}

std::int64_t Stim300OnPty::now_ns() {
  using std::chrono::steady_clock;  // CLOCK_MONOTONIC
  return std::chrono::duration_cast<std::chrono::nanoseconds>(steady_clock::now().time_since_epoch()).count();
}

void Stim300OnPty::hang_up() {
  thread_ = {};
  line_.hang_up();
}

void Stim300OnPty::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    exchange();
    std::this_thread::sleep_for(std::chrono::microseconds(300));
  }
}

void Stim300OnPty::exchange() {
  const std::lock_guard lock(mutex_);
  const std::int64_t t_ns = now_ns();
  unit_.receive(line_.read(), t_ns);
  for (Transmission& transmission : unit_.run_until(t_ns)) {
    if (line_.baud() != unit_.setup().baud) {  // a receiver at another speed sees other bits
      for (std::uint8_t& byte : transmission.bytes) byte = static_cast<std::uint8_t>(byte * 37U ^ 0x5AU);
    }
    line_.write(transmission.bytes);  // what a host does not read is lost, as on a real line
  }
}

}  // namespace plumb::emulator
