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
  /// When no transfer has succeeded for so long, the adapter is opened again by the same name, and no more often.
  static constexpr Duration kReopenPeriod = Duration::from_ms(100);

  /// Opens /dev/i2c-N and sets the timeout, without retries: what to do about a failure is for the driver to decide.
  /// Null, and the reason in `error`, when the device is not there or no I2C adapter.
  static std::unique_ptr<LinuxI2cBus> open(const std::string& device, std::string& error);
  ~LinuxI2cBus() override;
  LinuxI2cBus(const LinuxI2cBus&) = delete;
  LinuxI2cBus& operator=(const LinuxI2cBus&) = delete;

  Result<Time> write(std::uint8_t address, std::span<const std::uint8_t> bytes) override;
  Result<Time> read(std::uint8_t address, std::span<std::uint8_t> bytes) override;
  bool is_gone() const override { return file_ < 0; }
  int last_error() const override { return last_error_; }

 private:
  explicit LinuxI2cBus(std::string device) : device_(std::move(device)) {}
  /// Empty, or what is wrong with the adapter; in a text that lasts.
  const char* connect();
  bool come_back();
  bool select(std::uint8_t address);
  Result<Time> outcome(std::ptrdiff_t transferred, std::size_t wanted);
  Status failed(int error);

  std::string device_;
  int file_ = -1;                   ///< -1: the adapter is gone
  int selected_ = -1;               ///< the address that the file talks to
  Time next_reopen_ = Time::max();  ///< as long as transfers succeed there is nothing to reopen
  int last_error_ = 0;
};

}  // namespace plumb
