#pragma once
// The ports of the devices with the log behind them: what crosses them is in the log before the driver makes anything
// of it.

#include <algorithm>

#include "drivers/stim300/protocol.h"
#include "fsw/app/record_log.h"
#include "fsw/telemetry/raw_messages.h"
#include "hal/include/can_socket.h"
#include "hal/include/clock.h"
#include "hal/include/i2c_bus.h"
#include "hal/include/serial_port.h"

namespace plumb {

class RecordingSerialPort final : public SerialPort {
 public:
  RecordingSerialPort(SerialPort& port, LogSink& log) : port_(port), log_(log) {}

  Result<SerialChunk> read(std::span<std::uint8_t> buffer, Duration timeout) override {
    const Result<SerialChunk> chunk = port_.read(buffer, timeout);
    if (chunk) record(chunk->t, buffer.first(chunk->size));
    return chunk;
  }
  /// The driver was told at `t` that nothing came. It makes something of that too.
  void record_silence(Time t) { record(t, {}); }

  Status write(std::span<const std::uint8_t> bytes, Duration timeout) override { return port_.write(bytes, timeout); }
  int last_error() const override { return port_.last_error(); }
  std::uint64_t reopens() const override { return port_.reopens(); }

 private:
  void record(Time t, std::span<const std::uint8_t> bytes) {
    RawBytes raw;
    static_assert(stim300::kMaxChunkBytes <= raw.bytes.capacity(), "a read of the line fits one message");
    raw.t = t;
    raw.bytes.resize(bytes.size());
    std::copy(bytes.begin(), bytes.end(), raw.bytes.begin());
    log_.write(channel::kRawStim300, t, raw);
  }

  SerialPort& port_;
  RecordLog log_;
};

class RecordingI2cBus final : public I2cBus {
 public:
  RecordingI2cBus(I2cBus& bus, const Clock& clock, LogSink& log) : bus_(bus), clock_(clock), log_(log) {}

  Result<Time> write(std::uint8_t address, std::span<const std::uint8_t> bytes) override {
    const Time start = clock_.now();
    return record(bus_.write(address, bytes), start, address, false, bytes);
  }
  Result<Time> read(std::uint8_t address, std::span<std::uint8_t> bytes) override {
    const Time start = clock_.now();
    return record(bus_.read(address, bytes), start, address, true, bytes);
  }
  bool is_gone() const override { return bus_.is_gone(); }
  int last_error() const override { return bus_.last_error(); }

 private:
  Result<Time> record(const Result<Time>& stop, Time start, std::uint8_t address, bool is_read,
                      std::span<const std::uint8_t> bytes) {
    RawTransfer raw;
    raw.t_stop = stop ? *stop : clock_.now();
    raw.duration = raw.t_stop - start;
    raw.address = address;
    raw.is_read = is_read;
    raw.acknowledged = stop.has_value();
    raw.bytes.resize(stop ? std::min(bytes.size(), raw.bytes.capacity()) : 0);
    std::copy_n(bytes.begin(), raw.bytes.size(), raw.bytes.begin());
    log_.write(channel::kRawLidarLite, raw.t_stop, raw);
    return stop;
  }

  I2cBus& bus_;
  const Clock& clock_;
  RecordLog log_;
};

class RecordingCanSocket final : public CanSocket {
 public:
  RecordingCanSocket(CanSocket& socket, LogSink& log) : socket_(socket), log_(log) {}

  Result<ReceivedCanFrame> receive(Duration timeout) override {
    const Result<ReceivedCanFrame> received = socket_.receive(timeout);
    if (!received) return received;
    RawCanFrame raw;
    raw.t = received->t;
    raw.id = received->frame.id;
    raw.is_extended = received->frame.is_extended;
    raw.bytes.resize(received->frame.size);
    std::copy_n(received->frame.bytes.begin(), raw.bytes.size(), raw.bytes.begin());
    log_.write(channel::kRawCan, raw.t, raw);
    return received;
  }
  Status set_filters(std::span<const CanFilter> filters) override { return socket_.set_filters(filters); }
  Status send(const CanFrame& frame) override { return socket_.send(frame); }
  const CanHealth& health() const override { return socket_.health(); }
  int last_error() const override { return socket_.last_error(); }

 private:
  CanSocket& socket_;
  RecordLog log_;
};

}  // namespace plumb
