#pragma once
// What systemd wants to know of a service (sd_notify(3)): that it is ready, that it lives, that it stops. Datagrams to
// a Unix socket that the environment names; without one nobody is told.

#include <string>

#include "fsw/base/time.h"

namespace plumb {

class ServiceManager {
 public:
  /// From NOTIFY_SOCKET, WATCHDOG_USEC and WATCHDOG_PID.
  static ServiceManager from_environment();
  /// `socket`: a path, or a name behind @ for one that is in no folder; empty: nobody is told. `watchdog`: how long it
  /// waits for a stroke before it starts the process again; 0: for ever.
  ServiceManager(std::string socket, Duration watchdog);
  ~ServiceManager();
  ServiceManager(const ServiceManager&) = delete;
  ServiceManager& operator=(const ServiceManager&) = delete;

  Duration watchdog() const { return watchdog_; }
  /// For example "READY=1". False: it did not go out. Never waits.
  bool tell(const std::string& state);

 private:
  std::string address_;
  Duration watchdog_;
  int socket_ = -1;
};

}  // namespace plumb
