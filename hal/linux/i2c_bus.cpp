#include "hal/linux/i2c_bus.h"

#include <fcntl.h>
#include <linux/i2c-dev.h>
#include <linux/i2c.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "hal/linux/monotonic_clock.h"

namespace plumb {

std::unique_ptr<LinuxI2cBus> LinuxI2cBus::open(const std::string& device, std::string& error) {
  const int file = ::open(device.c_str(), O_RDWR | O_CLOEXEC);
  if (file < 0) {
    error = device + ": cannot be opened: " + std::strerror(errno);
    return nullptr;
  }
  std::unique_ptr<LinuxI2cBus> bus(new LinuxI2cBus(file));
  unsigned long functions = 0;
  constexpr unsigned long kTimeoutStep_ms = 10;
  if (ioctl(file, I2C_FUNCS, &functions) != 0 || ioctl(file, I2C_RETRIES, 0UL) != 0 ||
      ioctl(file, I2C_TIMEOUT, kTransferTimeout_ms / kTimeoutStep_ms) != 0) {
    error = device + ": is no I2C adapter: " + std::strerror(errno);
    return nullptr;
  }
  if ((functions & I2C_FUNC_I2C) == 0) {
    error = device + ": speaks SMBus only; plain I2C transfers are needed";
    return nullptr;
  }
  return bus;
}

LinuxI2cBus::~LinuxI2cBus() { close(file_); }

bool LinuxI2cBus::select(std::uint8_t address) {
  if (selected_ == address) return true;
  if (ioctl(file_, I2C_SLAVE, static_cast<unsigned long>(address)) != 0) {
    last_error_ = errno;
    return false;
  }
  selected_ = address;
  return true;
}

Result<Time> LinuxI2cBus::outcome(std::ptrdiff_t transferred, std::size_t wanted) {
  if (transferred == static_cast<std::ptrdiff_t>(wanted)) return clock_now();
  last_error_ = transferred < 0 ? errno : EIO;  // a transfer cut short is a failed one
  return Status::kRejected;
}

Result<Time> LinuxI2cBus::write(std::uint8_t address, std::span<const std::uint8_t> bytes) {
  if (!select(address)) return Status::kRejected;
  return outcome(::write(file_, bytes.data(), bytes.size()), bytes.size());
}

Result<Time> LinuxI2cBus::read(std::uint8_t address, std::span<std::uint8_t> bytes) {
  if (!select(address)) return Status::kRejected;
  return outcome(::read(file_, bytes.data(), bytes.size()), bytes.size());
}

}  // namespace plumb
