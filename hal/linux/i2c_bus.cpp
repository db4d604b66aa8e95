#include "hal/linux/i2c_bus.h"

#include <fcntl.h>
#include <linux/i2c-dev.h>
#include <linux/i2c.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cerrno>

#include "hal/linux/monotonic_clock.h"
#include "hal/linux/open_error.h"

namespace plumb {

std::unique_ptr<LinuxI2cBus> LinuxI2cBus::open(const std::string& device, std::string& error) {
  std::unique_ptr<LinuxI2cBus> bus(new LinuxI2cBus(device));
  const char* const wrong = bus->connect();
  if (*wrong == '\0') return bus;
  error = open_error(device, wrong);
  return nullptr;
}

LinuxI2cBus::~LinuxI2cBus() {
  if (file_ >= 0) close(file_);
}

const char* LinuxI2cBus::connect() {
  selected_ = -1;
  errno = 0;
  file_ = ::open(device_.c_str(), O_RDWR | O_CLOEXEC);
  if (file_ < 0) return "cannot be opened";
  unsigned long functions = 0;
  constexpr unsigned long kTimeoutStep_ms = 10;
  if (ioctl(file_, I2C_FUNCS, &functions) != 0 || ioctl(file_, I2C_RETRIES, 0UL) != 0 ||
      ioctl(file_, I2C_TIMEOUT, kTransferTimeout_ms / kTimeoutStep_ms) != 0) {
    return "is no I2C adapter";
  }
  return (functions & I2C_FUNC_I2C) != 0 ? "" : "speaks SMBus only; plain I2C transfers are needed";
}

// By the system's reasons a device that does not acknowledge is not told from an adapter that was pulled out: both may
// be ENXIO or EIO. A new file harms neither, and the system holds on to what was pulled out until the old one is
// closed.
bool LinuxI2cBus::come_back() {
  const Time now = clock_now();
  if (now < next_reopen_) return file_ >= 0;
  next_reopen_ = now + kReopenPeriod;
  if (file_ >= 0) close(file_);
  if (*connect() == '\0') return true;
  last_error_ = errno != 0 ? errno : EOPNOTSUPP;  // it speaks SMBus only
  if (file_ >= 0) close(file_);
  file_ = -1;
  return false;
}

Status LinuxI2cBus::failed(int error) {
  last_error_ = error;
  if (next_reopen_ == Time::max()) next_reopen_ = clock_now() + kReopenPeriod;
  return Status::kRejected;
}

bool LinuxI2cBus::select(std::uint8_t address) {
  if (selected_ == address) return true;
  if (ioctl(file_, I2C_SLAVE, static_cast<unsigned long>(address)) != 0) {
    (void)failed(errno);
    return false;
  }
  selected_ = address;
  return true;
}

Result<Time> LinuxI2cBus::outcome(std::ptrdiff_t transferred, std::size_t wanted) {
  // A transfer cut short is a failed one.
  if (transferred != static_cast<std::ptrdiff_t>(wanted)) return failed(transferred < 0 ? errno : EIO);
  next_reopen_ = Time::max();
  return clock_now();
}

Result<Time> LinuxI2cBus::write(std::uint8_t address, std::span<const std::uint8_t> bytes) {
  if (!come_back() || !select(address)) return Status::kRejected;
  return outcome(::write(file_, bytes.data(), bytes.size()), bytes.size());
}

Result<Time> LinuxI2cBus::read(std::uint8_t address, std::span<std::uint8_t> bytes) {
  if (!come_back() || !select(address)) return Status::kRejected;
  return outcome(::read(file_, bytes.data(), bytes.size()), bytes.size());
}

}  // namespace plumb
