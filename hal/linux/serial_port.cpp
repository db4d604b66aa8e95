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

#include "hal/linux/monotonic_clock.h"
#include "hal/linux/open_error.h"

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
const char* difference(const termios2& actual, const termios2& wanted) {
  if (!speed_is(actual.c_ospeed, wanted.c_ospeed) || !speed_is(actual.c_ispeed, wanted.c_ospeed)) {
    return "the driver took another speed than asked for";
  }
  constexpr tcflag_t kFormat = CSIZE | PARENB | PARODD | CSTOPB;
  if ((actual.c_cflag & kFormat) != (wanted.c_cflag & kFormat)) {
    return "the driver has another number of data bits, stop bits or parity than asked for";
  }
  return "";
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
  std::unique_ptr<LinuxSerialPort> port(new LinuxSerialPort(device, options));
  errno = 0;
  const char* const wrong = port->connect();
  if (*wrong == '\0') return port;
  error = open_error(device, wrong);
  return nullptr;
}

LinuxSerialPort::~LinuxSerialPort() {
  if (file_ >= 0) close(file_);
}

const char* LinuxSerialPort::connect() {
  file_ = ::open(device_.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (file_ < 0) return "cannot be opened";
  // Two readers would each get a part of the bytes. TIOCEXCL alone does not keep out the superuser.
  if (flock(file_, LOCK_EX | LOCK_NB) != 0) {
    errno = EBUSY;  // "temporarily unavailable" would say less
    return "is in use by another program";
  }
  const termios2 wanted = raw_mode(options_);
  termios2 actual{};
  if (ioctl(file_, TIOCEXCL) != 0 || ioctl(file_, TCSETS2, &wanted) != 0 || ioctl(file_, TCGETS2, &actual) != 0) {
    return "cannot be set up as a serial line";
  }
  if (const char* wrong = difference(actual, wanted); *wrong != '\0') return wrong;
  const int error = errno;
  low_latency_ = set_low_latency(file_);  // few drivers offer it
  errno = error;
  return ioctl(file_, TCFLSH, TCIFLUSH) == 0 ? "" : "cannot be emptied";
}

bool LinuxSerialPort::come_back() {
  if (file_ >= 0) return true;
  const Time now = clock_now();
  if (now < next_reopen_) return false;
  next_reopen_ = now + kReopenPeriod;
  errno = 0;
  if (*connect() == '\0') {
    ++reopens_;
    return true;
  }
  last_error_ = errno != 0 ? errno : EINVAL;  // another speed or format than asked for
  if (file_ >= 0) close(file_);
  file_ = -1;
  return false;
}

// Whatever the system refuses once, a new file may be given: an adapter that was pulled out and put back is another one
// under the same name.
Status LinuxSerialPort::failed(int error) {
  last_error_ = error;
  close(file_);
  file_ = -1;
  next_reopen_ = clock_now() + kReopenPeriod;
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
  if (!come_back()) return Status::kRejected;
  if (const Status status = wait(POLLIN, clock_now() + timeout); !ok(status)) return status;
  const ssize_t size = ::read(file_, buffer.data(), buffer.size());
  if (size > 0) return SerialChunk{.t = clock_now(), .size = static_cast<std::size_t>(size)};
  if (size == 0) return failed(ENODEV);  // end of file: the device is gone
  if (errno == EAGAIN || errno == EINTR) return Status::kNotReady;
  return failed(errno);
}

Status LinuxSerialPort::write(std::span<const std::uint8_t> bytes, Duration timeout) {
  if (!come_back()) return Status::kRejected;
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
