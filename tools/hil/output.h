#pragma once
// The interfaces of this host that a recorded flight is played out of. Each takes the messages of one channel.

#include <memory>
#include <string>

#include "fsw/telemetry/messages.h"

namespace plumb::hil {

class Output {
 public:
  virtual ~Output() = default;
  /// What this device said is on this channel of a log.
  virtual const char* channel() const = 0;
  /// Where the flight computer finds it, for the user.
  virtual const std::string& place() const = 0;
  /// kOk: it is out. kFull: the interface has no room, or is away; what was to be said is lost, as on a line that
  /// nobody reads. kInvalidValue: no message of the channel. Never waits.
  virtual Status put(MessageBytes message) = 0;
};

/// Each throws InputError naming the interface and what is wrong with it.
std::unique_ptr<Output> open_serial(const std::string& device, std::uint32_t baud);
/// A pseudo-terminal of its own. `link`: file name that will lead to it.
std::unique_ptr<Output> make_pseudo_terminal(const std::string& link);
std::unique_ptr<Output> open_can(const std::string& interface_name);
/// `memory`: registers of a device on an I2C bus that this host is, as a file: slave-eeprom of the kernel's
/// slave-24c02.
std::unique_ptr<Output> open_registers(const std::string& memory);
/// Size of the images [px].
std::unique_ptr<Output> open_video(const std::string& device, int width, int height);

}  // namespace plumb::hil
