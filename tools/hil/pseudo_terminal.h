#pragma once
// A real serial line without hardware: a driver opens device(), whoever has this holds the other end.

#include <asm/ioctls.h>
#include <asm/termbits.h>
#include <fcntl.h>
#include <stdlib.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace plumb::hil {

class PseudoTerminal {
 public:
  PseudoTerminal() : file_(posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC)) {
    std::array<char, 64> name{};
    if (file_ < 0 || grantpt(file_) != 0 || unlockpt(file_) != 0 || ptsname_r(file_, name.data(), name.size()) != 0) {
      throw std::runtime_error("no pseudo-terminal can be made");
    }
    device_ = name.data();
    // Before anyone opens it the line echoes; this end must not hear itself.
    termios2 mode{};
    mode.c_cflag = CS8 | CREAD | B38400;
    if (ioctl(file_, TCSETS2, &mode) != 0) throw std::runtime_error("the pseudo-terminal cannot be set up");
  }
  ~PseudoTerminal() { hang_up(); }
  PseudoTerminal(const PseudoTerminal&) = delete;
  PseudoTerminal& operator=(const PseudoTerminal&) = delete;

  const std::string& device() const { return device_; }
  /// bit/s that the other end has set.
  std::uint32_t baud() const {
    termios2 mode{};
    return ioctl(file_, TCGETS2, &mode) == 0 ? mode.c_ospeed : 0;
  }
  /// What the other end has sent so far.
  std::vector<std::uint8_t> read() {
    std::array<std::uint8_t, 256> buffer{};
    const ssize_t size = ::read(file_, buffer.data(), buffer.size());
    return {buffer.begin(), buffer.begin() + (size > 0 ? size : 0)};
  }
  /// False when the line cannot take all of it, as one that nobody reads.
  bool write(std::span<const std::uint8_t> bytes) {
    return ::write(file_, bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size());
  }
  /// Pulls the plug.
  void hang_up() {
    if (file_ >= 0) close(file_);
    file_ = -1;
  }

 private:
  int file_;
  std::string device_;
};

}  // namespace plumb::hil
