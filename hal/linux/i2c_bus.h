#pragma once
// I2cBus on Linux's i2c-dev, by plain read(2) and write(2): each is one transfer that ends in a STOP.

#include <memory>
#include <string>

#include "hal/include/i2c_bus.h"

namespace plumb {

class LinuxI2cBus final : public I2cBus {
 public:
  /// The adapter's own timeout, per transfer. The system counts it in steps of 10 ms.
  static constexpr int kTransferTimeout_ms = 20;

  /// Opens /dev/i2c-N and sets the timeout, without retries: what to do about a failure is for the driver to decide.
  /// Null, and the reason in `error`, when the device is not there or no I2C adapter.
  static std::unique_ptr<LinuxI2cBus> open(const std::string& device, std::string& error);
  ~LinuxI2cBus() override;
  LinuxI2cBus(const LinuxI2cBus&) = delete;
  LinuxI2cBus& operator=(const LinuxI2cBus&) = delete;

  Result<Time> write(std::uint8_t address, std::span<const std::uint8_t> bytes) override;
  Result<Time> read(std::uint8_t address, std::span<std::uint8_t> bytes) override;
  int last_error() const override { return last_error_; }

 private:
  explicit LinuxI2cBus(int file) : file_(file) {}
  bool select(std::uint8_t address);
  Result<Time> outcome(std::ptrdiff_t transferred, std::size_t wanted);

  int file_;
  int selected_ = -1;  ///< the address that the file talks to
  int last_error_ = 0;
};

}  // namespace plumb
