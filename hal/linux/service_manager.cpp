#include "hal/linux/service_manager.h"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <cstdlib>

namespace plumb {
namespace {

std::string variable(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
}

}  // namespace

ServiceManager ServiceManager::from_environment() {
  const std::string pid = variable("WATCHDOG_PID");
  const bool ours = pid.empty() || std::atoll(pid.c_str()) == getpid();
  const std::int64_t watchdog_us = ours ? std::atoll(variable("WATCHDOG_USEC").c_str()) : 0;
  return {variable("NOTIFY_SOCKET"), Duration::from_us(std::max<std::int64_t>(watchdog_us, 0))};
}

ServiceManager::ServiceManager(std::string socket_name, Duration watchdog)
    : address_(std::move(socket_name)), watchdog_(watchdog) {
  if (address_.empty() || address_.size() >= sizeof sockaddr_un{}.sun_path) return;
  if (address_[0] == '@') address_[0] = '\0';  // as the kernel marks a name that is in no folder
  socket_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
}

ServiceManager::~ServiceManager() {
  if (socket_ >= 0) close(socket_);
}

bool ServiceManager::tell(const std::string& state) {
  if (socket_ < 0) return false;
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::copy(address_.begin(), address_.end(), address.sun_path);
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + address_.size());
  const ssize_t sent =
      sendto(socket_, state.data(), state.size(), MSG_NOSIGNAL, reinterpret_cast<const sockaddr*>(&address), size);
  return sent == static_cast<ssize_t>(state.size());
}

}  // namespace plumb
