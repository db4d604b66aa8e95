#include "tools/hil/output.h"

#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <stdexcept>

#include "config/input_error.h"
#include "fsw/telemetry/raw_messages.h"
#include "hal/linux/can_socket.h"
#include "hal/linux/serial_port.h"
#include "tools/hil/pseudo_terminal.h"
#include "tools/hil/video_output.h"

namespace plumb::hil {
namespace {

/// The bytes of the STIM300 into a line.
template <class Line>
class SerialOutput final : public Output {
 public:
  /// write(bytes): whether the line took all of them.
  SerialOutput(std::string place, Line line) : place_(std::move(place)), line_(std::move(line)) {}
  const char* channel() const override { return channel::kRawStim300; }
  const std::string& place() const override { return place_; }
  Status put(MessageBytes message) override {
    RawBytes raw;
    if (!ok(decode(message, raw))) return Status::kInvalidValue;
    return raw.bytes.empty() || line_.write({raw.bytes.data(), raw.bytes.size()}) ? Status::kOk : Status::kFull;
  }

 private:
  std::string place_;
  Line line_;
};

struct Port {
  std::unique_ptr<LinuxSerialPort> port;
  bool write(std::span<const std::uint8_t> bytes) { return ok(port->write(bytes, Duration())); }
};

/// The link goes with the line that it leads to.
struct LinkedTerminal {
  std::unique_ptr<PseudoTerminal> terminal;
  std::string link;
  LinkedTerminal(std::unique_ptr<PseudoTerminal> made, std::string name)
      : terminal(std::move(made)), link(std::move(name)) {}
  LinkedTerminal(LinkedTerminal&&) = default;
  ~LinkedTerminal() {
    std::error_code ignored;  // somebody else took it away
    if (terminal != nullptr) std::filesystem::remove(link, ignored);
  }
  bool write(std::span<const std::uint8_t> bytes) {
    terminal->read();  // what the flight computer asks of the unit; a recording has the answers that came then
    return terminal->write(bytes);
  }
};

class CanOutput final : public Output {
 public:
  CanOutput(std::string place, std::unique_ptr<LinuxCanSocket> bus) : place_(std::move(place)), bus_(std::move(bus)) {}
  const char* channel() const override { return channel::kRawCan; }
  const std::string& place() const override { return place_; }
  Status put(MessageBytes message) override {
    RawCanFrame raw;
    if (!ok(decode(message, raw))) return Status::kInvalidValue;
    CanFrame frame{.id = raw.id, .is_extended = raw.is_extended};
    frame.size = static_cast<std::uint8_t>(raw.bytes.size());
    std::copy(raw.bytes.begin(), raw.bytes.end(), frame.bytes.begin());
    const Status status = bus_->send(frame);
    return status == Status::kRejected ? Status::kFull : status;
  }

 private:
  std::string place_;
  std::unique_ptr<LinuxCanSocket> bus_;
};

/// What was read of the LIDAR-Lite into the registers that it was read from, for whoever reads them next.
class RegisterOutput final : public Output {
 public:
  RegisterOutput(std::string place, std::unique_ptr<DeviceFile> memory)
      : place_(std::move(place)), memory_(std::move(memory)) {}
  const char* channel() const override { return channel::kRawLidarLite; }
  const std::string& place() const override { return place_; }
  Status put(MessageBytes message) override {
    RawTransfer raw;
    if (!ok(decode(message, raw))) return Status::kInvalidValue;
    if (!raw.acknowledged || raw.bytes.empty()) return Status::kOk;
    if (!raw.is_read) {  // the register that is read next, and perhaps a command, which is the other side's to give
      register_ = raw.bytes[0];
      return Status::kOk;
    }
    const auto size = static_cast<ssize_t>(raw.bytes.size());
    return pwrite(memory_->get(), raw.bytes.data(), raw.bytes.size(), register_) == size ? Status::kOk : Status::kFull;
  }

 private:
  std::string place_;
  std::unique_ptr<DeviceFile> memory_;
  std::uint8_t register_ = 0;
};

class CameraOutput final : public Output {
 public:
  CameraOutput(std::string place, std::unique_ptr<VideoOutput> video, std::size_t pixels)
      : place_(std::move(place)), video_(std::move(video)), pixels_(pixels) {}
  const char* channel() const override { return channel::kCamera; }
  const std::string& place() const override { return place_; }
  Status put(MessageBytes message) override {
    CameraFrame frame;
    if (!ok(decode(message, frame))) return Status::kInvalidValue;
    const ImageView& image = frame.image;
    if (image.stride != image.width || static_cast<std::size_t>(image.width) * image.height != pixels_) {
      return Status::kInvalidValue;
    }
    return video_->write({image.pixels, pixels_}) ? Status::kOk : Status::kFull;
  }

 private:
  std::string place_;
  std::unique_ptr<VideoOutput> video_;
  std::size_t pixels_;
};

}  // namespace

std::unique_ptr<Output> open_serial(const std::string& device, std::uint32_t baud) {
  std::string error;
  std::unique_ptr<LinuxSerialPort> port = LinuxSerialPort::open(device, {.baud = baud}, error);
  if (port == nullptr) throw InputError("--serial " + error);
  return std::make_unique<SerialOutput<Port>>(device, Port{std::move(port)});
}

std::unique_ptr<Output> make_pseudo_terminal(const std::string& link) {
  std::unique_ptr<PseudoTerminal> terminal;
  try {
    terminal = std::make_unique<PseudoTerminal>();
  } catch (const std::runtime_error& error) {
    throw InputError(std::string("--pty: ") + error.what());
  }
  std::error_code error;
  std::filesystem::create_symlink(terminal->device(), link, error);
  if (error) throw InputError("--pty " + link + ": the link cannot be made: " + error.message());
  const std::string place = link + " (" + terminal->device() + ")";
  return std::make_unique<SerialOutput<LinkedTerminal>>(place, LinkedTerminal(std::move(terminal), link));
}

std::unique_ptr<Output> open_can(const std::string& interface_name) {
  std::string error;
  std::unique_ptr<LinuxCanSocket> bus = LinuxCanSocket::open(interface_name, error);
  if (bus == nullptr) throw InputError("--can " + error);
  return std::make_unique<CanOutput>(interface_name, std::move(bus));
}

std::unique_ptr<Output> open_registers(const std::string& memory) {
  auto file = std::make_unique<DeviceFile>();
  if (const int error = file->open(memory); error != 0)
    throw InputError("--i2c " + memory + ": " + std::strerror(error));
  return std::make_unique<RegisterOutput>(memory, std::move(file));
}

std::unique_ptr<Output> open_video(const std::string& device, int width, int height) {
  std::string error;
  std::unique_ptr<VideoOutput> video = VideoOutput::open(device, width, height, error);
  if (video == nullptr) throw InputError("--video " + error);
  return std::make_unique<CameraOutput>(device, std::move(video), static_cast<std::size_t>(width) * height);
}

}  // namespace plumb::hil
