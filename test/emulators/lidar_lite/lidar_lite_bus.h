#pragma once
// The I2cBus port with an emulated LIDAR-Lite behind it, on a clock of its own that transfers move on.

#include <cerrno>

#include "hal/include/i2c_bus.h"
#include "test/emulators/lidar_lite/lidar_lite_emulator.h"

namespace plumb::test {

class LidarLiteBus final : public I2cBus {
 public:
  explicit LidarLiteBus(LidarLiteEmulator& device) : device_(device) {}

  Time now() const { return now_; }
  void wait_until(Time t) {
    if (t > now_) now_ = t;
  }

  Result<Time> write(std::uint8_t address, std::span<const std::uint8_t> bytes) override {
    spend(bytes.size());
    return outcome(device_.write(address, bytes, now_.ns()));
  }
  Result<Time> read(std::uint8_t address, std::span<std::uint8_t> bytes) override {
    spend(bytes.size());
    return outcome(device_.read(address, bytes, now_.ns()));
  }
  bool is_gone() const override { return false; }
  int last_error() const override { return last_error_; }

 private:
  /// START, address and bytes with their acknowledge bits, STOP at 400 kHz.
  void spend(std::size_t bytes) {
    constexpr std::int64_t kBit_ns = 2500;
    now_ = now_ + Duration::from_ns((9 * (static_cast<std::int64_t>(bytes) + 1) + 2) * kBit_ns);
  }
  Result<Time> outcome(bool acknowledged) {
    if (acknowledged) return now_;
    last_error_ = ENXIO;
    return Status::kRejected;
  }

  LidarLiteEmulator& device_;
  Time now_ = Time::from_ns(0);
  int last_error_ = 0;
};

}  // namespace plumb::test
