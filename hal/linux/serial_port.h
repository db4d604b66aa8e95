#pragma once
// SerialPort on a Linux terminal device: a UART, a USB adapter, or a pseudo-terminal in tests.

#include <cstdint>
#include <memory>
#include <string>

#include "hal/include/serial_port.h"

namespace plumb {

enum class Parity : std::uint8_t { kNone = 0, kEven, kOdd };

struct SerialOptions {
  std::uint32_t baud = 921600;  ///< bit/s, any that the hardware has, not only the names of termios
  Parity parity = Parity::kNone;
  bool two_stop_bits = false;
};

class LinuxSerialPort final : public SerialPort {
 public:
  /// A line that went away is opened again, by the same name, no more often than this.
  static constexpr Duration kReopenPeriod = Duration::from_ms(100);

  /// Opens the device for this process alone and sets it to raw bytes of 8 bits. What the system then says is set is
  /// compared with what was asked: some drivers silently take another speed. Bytes that had come in before are dropped.
  /// Null, and the reason in `error`, when the device is not there, taken, no terminal, or cannot do it.
  static std::unique_ptr<LinuxSerialPort> open(const std::string& device, const SerialOptions& options,
                                               std::string& error);
  ~LinuxSerialPort() override;
  LinuxSerialPort(const LinuxSerialPort&) = delete;
  LinuxSerialPort& operator=(const LinuxSerialPort&) = delete;

  Result<SerialChunk> read(std::span<std::uint8_t> buffer, Duration timeout) override;
  Status write(std::span<const std::uint8_t> bytes, Duration timeout) override;
  int last_error() const override { return last_error_; }
  std::uint64_t reopens() const override { return reopens_; }

  /// Whether the driver hands bytes over as they come. Without it a USB adapter may hold them for 16 ms.
  bool low_latency() const { return low_latency_; }

 private:
  LinuxSerialPort(std::string device, const SerialOptions& options) : device_(std::move(device)), options_(options) {}
  /// Empty, or what is wrong with the line; in a text that lasts.
  const char* connect();
  bool come_back();
  /// Waits for one of the poll(2) `events`: kOk, kNotReady after the deadline, or kRejected.
  Status wait(short events, Time deadline);
  Status failed(int error);

  std::string device_;
  SerialOptions options_;
  int file_ = -1;  ///< -1: the line is gone
  Time next_reopen_;
  std::uint64_t reopens_ = 0;
  int last_error_ = 0;
  bool low_latency_ = false;
};

}  // namespace plumb
