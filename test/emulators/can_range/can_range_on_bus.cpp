#include "test/emulators/can_range/can_range_on_bus.h"

#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <stdexcept>

namespace plumb::test {
namespace {

int open_bus(const std::string& name) {
  const int bus = socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, CAN_RAW);
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(if_nametoindex(name.c_str()));
  const bool opened = bus >= 0 && address.can_ifindex != 0 &&
                      bind(bus, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  if (opened) return bus;
  if (bus >= 0) close(bus);
  throw std::runtime_error("no CAN interface " + name);
}

}  // namespace

CanRangeOnBus::CanRangeOnBus(const std::string& interface_name, CanRangeEmulator::Kind kind, std::uint64_t seed)
    : socket_(open_bus(interface_name)),
      unit_(kind, now_ns(), seed),
      thread_([this](const std::stop_token& stop) { run(stop); }) {}

CanRangeOnBus::~CanRangeOnBus() {
  thread_ = {};
  close(socket_);
}

std::int64_t CanRangeOnBus::now_ns() {
  using std::chrono::steady_clock;  // CLOCK_MONOTONIC
  return std::chrono::duration_cast<std::chrono::nanoseconds>(steady_clock::now().time_since_epoch()).count();
}

void CanRangeOnBus::tell_bus_off(bool off) {
  can_frame frame{};
  frame.can_id = CAN_ERR_FLAG | (off ? CAN_ERR_BUSOFF : CAN_ERR_RESTARTED);
  frame.can_dlc = CAN_ERR_DLC;
  if (write(socket_, &frame, sizeof frame) != static_cast<ssize_t>(sizeof frame)) {
    throw std::runtime_error("the bus takes no error frame");
  }
}

void CanRangeOnBus::run(const std::stop_token& stop) {
  for (; !stop.stop_requested(); std::this_thread::sleep_for(std::chrono::microseconds(500))) {
    const std::lock_guard lock(mutex_);
    for (const CanTransmission& sent : unit_.run_until(now_ns())) {
      can_frame out{};
      out.can_id = sent.frame.id | (sent.frame.is_extended ? CAN_EFF_FLAG : 0U);
      out.can_dlc = sent.frame.size;
      std::copy_n(sent.frame.bytes.begin(), sent.frame.size, out.data);
      static_cast<void>(!write(socket_, &out, sizeof out));  // lost while the interface is down, as on a real bus
    }
  }
}

}  // namespace plumb::test
