#include "hal/linux/serial_port.h"

// Speeds without a name need termios2, whose header excludes <termios.h>.
#include <asm/ioctls.h>
#include <asm/termbits.h>
#include <fcntl.h>
#include <linux/serial.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "hal/linux/monotonic_clock.h"

namespace plumb {
namespace {

// A receiver samples a bit within half its length up to the tenth bit; beyond 2 % in all, bytes get lost.
constexpr double kMaxBaudError = 0.02;

termios2 raw_mode(const SerialOptions& options) {
  termios2 mode{};
  mode.c_cflag = CS8 | CREAD | CLOCAL | BOTHER;
  if (options.parity != Parity::kNone) mode.c_cflag |= PARENB;
  if (options.parity == Parity::kOdd) mode.c_cflag |= PARODD;
  if (options.two_stop_bits) mode.c_cflag |= CSTOPB;
  mode.c_iflag = IGNBRK;
  // A byte whose parity is wrong comes as a zero, so that its datagram keeps its length and fails its checksum.
  if (options.parity != Parity::kNone) mode.c_iflag |= INPCK;
  mode.c_ispeed = options.baud;
  mode.c_ospeed = options.baud;
  return mode;
}

bool speed_is(speed_t actual, std::uint32_t wanted) {
  const double error = static_cast<double>(actual) - static_cast<double>(wanted);
  return error <= kMaxBaudError * wanted && error >= -kMaxBaudError * wanted;
}

// What the terminal does although it was asked for something else; empty when nothing.
std::string difference(const termios2& actual, const termios2& wanted) {
  if (!speed_is(actual.c_ospeed, wanted.c_ospeed) || !speed_is(actual.c_ispeed, wanted.c_ospeed)) {
    return "the driver took " + std::to_string(actual.c_ospeed) + " bit/s instead of " +
           std::to_string(wanted.c_ospeed);
  }
  constexpr tcflag_t kFormat = CSIZE | PARENB | PARODD | CSTOPB;
  if ((actual.c_cflag & kFormat) != (wanted.c_cflag & kFormat)) {
    return "the driver has another number of data bits, stop bits or parity than asked for";
  }
  return {};
}

bool set_low_latency(int file) {
  serial_struct serial{};
  if (ioctl(file, TIOCGSERIAL, &serial) != 0) return false;
  serial.flags |= ASYNC_LOW_LATENCY;
  return ioctl(file, TIOCSSERIAL, &serial) == 0;
}

}  // namespace

std::unique_ptr<LinuxSerialPort> LinuxSerialPort::open(const std::string& device, const SerialOptions& options,
                                                       std::string& error) {
  const auto refuse = [&](const std::string& reason) {
    error = device + ": " + reason;
    return nullptr;
  };
  const int file = ::open(device.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (file < 0) return refuse(std::string("cannot be opened: ") + std::strerror(errno));
  std::unique_ptr<LinuxSerialPort> port(new LinuxSerialPort(file));
  // Two readers would each get a part of the bytes. TIOCEXCL alone does not keep out the superuser.
  if (flock(file, LOCK_EX | LOCK_NB) != 0) return refuse("is in use by another program");
  const termios2 wanted = raw_mode(options);
  termios2 actual{};
  if (ioctl(file, TIOCEXCL) != 0 || ioctl(file, TCSETS2, &wanted) != 0 || ioctl(file, TCGETS2, &actual) != 0) {
    return refuse(std::string("cannot be set up as a serial line: ") + std::strerror(errno));
  }
  if (const std::string wrong = difference(actual, wanted); !wrong.empty()) return refuse(wrong);
  port->low_latency_ = set_low_latency(file);
  if (ioctl(file, TCFLSH, TCIFLUSH) != 0) return refuse(std::string("cannot be emptied: ") + std::strerror(errno));
  return port;
}

LinuxSerialPort::~LinuxSerialPort() { close(file_); }

Status LinuxSerialPort::failed(int error) {
  last_error_ = error;
  return Status::kRejected;
}

Status LinuxSerialPort::wait(short events, Time deadline) {
  for (;;) {  // once, and again only after a signal, until the deadline
    const Duration left = deadline - clock_now();
    const int ready = wait_for(file_, events, left);
    if (ready > 0) return Status::kOk;
    if (ready < 0 && errno != EINTR) return failed(errno);
    if (ready == 0 || left <= Duration()) return Status::kNotReady;
  }
}

Result<SerialChunk> LinuxSerialPort::read(std::span<std::uint8_t> buffer, Duration timeout) {
  if (buffer.empty()) return Status::kInvalidValue;
  if (const Status status = wait(POLLIN, clock_now() + timeout); !ok(status)) return status;
  const ssize_t size = ::read(file_, buffer.data(), buffer.size());
  if (size > 0) return SerialChunk{.t = clock_now(), .size = static_cast<std::size_t>(size)};
  if (size == 0) return failed(ENODEV);  // end of file: the device is gone
  if (errno == EAGAIN || errno == EINTR) return Status::kNotReady;
  return failed(errno);
}

Status LinuxSerialPort::write(std::span<const std::uint8_t> bytes, Duration timeout) {
  const Time deadline = clock_now() + timeout;
  while (!bytes.empty()) {  // each turn hands over a byte at least, or waits; the deadline ends both
    const ssize_t size = ::write(file_, bytes.data(), bytes.size());
    if (size > 0) {
      bytes = bytes.subspan(static_cast<std::size_t>(size));
      continue;
    }
    if (size < 0 && errno == EINTR) continue;
    if (size < 0 && errno != EAGAIN) return failed(errno);
    const Status status = wait(POLLOUT, deadline);
    if (status == Status::kNotReady) {
      last_error_ = EAGAIN;
      return Status::kFull;
    }
    if (!ok(status)) return status;
  }
  return Status::kOk;
}

}  // namespace plumb
