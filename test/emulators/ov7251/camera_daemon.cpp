#include "test/emulators/ov7251/camera_daemon.h"

#include <fcntl.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <stdexcept>
#include <utility>

namespace plumb::emulator {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr int kKindFrame = 1;
constexpr int kKindMode = 2;
constexpr int kKindStart = 3;
constexpr int kKindExpose = 4;
constexpr int kKindStop = 5;
constexpr std::int64_t kGainUnit = 1000;

std::int64_t now_ns() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
}

void put(Bytes& message, std::size_t offset, std::int64_t value, int size) {
  for (int i = 0; i < size; ++i)
    message.at(offset + static_cast<std::size_t>(i)) = static_cast<std::uint8_t>(value >> (8 * i));
}

std::int64_t get(const Bytes& message, std::size_t offset, int size) {
  std::uint64_t value = 0;
  for (int i = size - 1; i >= 0; --i) value = value << 8 | message.at(offset + static_cast<std::size_t>(i));
  return static_cast<std::int64_t>(value);
}

Bytes message_of(int kind) {
  Bytes message(48, 0);
  const std::array<std::uint8_t, 4> magic = {'P', 'C', 'A', 'M'};
  std::copy(magic.begin(), magic.end(), message.begin());
  put(message, 4, 1, 2);
  put(message, 6, kind, 2);
  return message;
}

}  // namespace

CameraDaemon::CameraDaemon(std::string path) : path_(std::move(path)), sensor_(now_ns(), 1) {
  listening_ = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path_.copy(address.sun_path, sizeof address.sun_path - 1);
  unlink(path_.c_str());
  if (bind(listening_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      listen(listening_, 1) != 0) {
    throw std::runtime_error(path_ + ": cannot be listened at");
  }
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

CameraDaemon::~CameraDaemon() {
  thread_ = {};
  if (client_ >= 0) close(client_);
  close(listening_);
  unlink(path_.c_str());
}

void CameraDaemon::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    exchange();
    std::this_thread::sleep_for(std::chrono::microseconds(300));
  }
}

void CameraDaemon::accept_client() {
  client_ = accept4(listening_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
  if (client_ < 0) return;
  constexpr int kSendBuffer = 212992;
  setsockopt(client_, SOL_SOCKET, SO_SNDBUF, &kSendBuffer, sizeof kSendBuffer);
}

void CameraDaemon::exchange() {
  const std::lock_guard lock(mutex_);
  if (client_ < 0) accept_client();
  if (client_ >= 0) {
    Bytes request(64);
    const ssize_t size = recv(client_, request.data(), request.size(), 0);
    if (size == 0) {
      close(client_);
      client_ = -1;
      streaming_ = false;
    } else if (size > 0) {
      request.resize(static_cast<std::size_t>(size));
      on_request(request);
    }
  }
  while (sensor_.next_end_ns() <= now_ns()) {
    // On a machine too busy to make every image, those that are late are lost instead of later and later.
    const bool late = now_ns() - sensor_.next_end_ns() > 2 * sensor_.period_ns();
    if (late && sensor_.world.lose_next == 0) sensor_.world.lose_next = 1;
    const std::optional<Ov7251Image> image = sensor_.next_image();
    if (image && streaming_ && client_ >= 0) send_frame(*image);
  }
}

void CameraDaemon::on_request(const Bytes& request) {
  const std::int64_t kind = get(request, 6, 2);
  if (kind == kKindStart) {
    sensor_.set_frame_lines(
        static_cast<int>((get(request, 8, 8) + Ov7251Emulator::kLine_ns / 2) / Ov7251Emulator::kLine_ns));
    streaming_ = true;
    trigger_ = static_cast<int>(get(request, 24, 1));
    if (!behaviour_.answers) return;
    Bytes answer = message_of(kKindMode);
    put(answer, 8, sensor_.period_ns(), 8);
    put(answer, 16, behaviour_.width, 4);
    put(answer, 20, Ov7251Emulator::kHeight, 4);
    put(answer, 24, Ov7251Emulator::kLine_ns, 8);
    put(answer, 32, sensor_.period_ns() - 20 * Ov7251Emulator::kLine_ns, 8);
    put(answer, 40, kGainUnit, 4);
    put(answer, 44, 1023 * kGainUnit / 16, 4);
    (void)send(client_, answer.data(), answer.size(), MSG_NOSIGNAL);
  } else if (kind == kKindExpose) {
    sensor_.write_exposure_lines(
        static_cast<int>((get(request, 8, 8) + Ov7251Emulator::kLine_ns / 2) / Ov7251Emulator::kLine_ns));
    sensor_.write_gain(static_cast<int>((get(request, 16, 4) * 16 + kGainUnit / 2) / kGainUnit));
  } else if (kind == kKindStop) {
    streaming_ = false;
  }
}

void CameraDaemon::send_frame(const Ov7251Image& image) {
  for (; behaviour_.garbage > 0; --behaviour_.garbage) {
    const Bytes none(static_cast<std::size_t>(behaviour_.garbage), 0x55);
    (void)send(client_, none.data(), none.size(), MSG_NOSIGNAL);
  }
  Bytes message = message_of(kKindFrame);
  const std::int64_t stamp_ns = behaviour_.stamp == 1 ? image.start_of_exposure_ns : image.end_of_frame_ns;
  put(message, 8, stamp_ns + behaviour_.stamp_error_ns, 8);
  put(message, 16, image.sequence, 4);
  put(message, 20, behaviour_.stamp, 1);
  put(message, 21, (image.damaged ? 1 : 0) + (behaviour_.tells_exposure ? 2 : 0), 1);
  put(message, 24, behaviour_.width, 4);
  put(message, 28, Ov7251Emulator::kHeight, 4);
  put(message, 32, Ov7251Emulator::kWidth, 4);
  put(message, 36, image.gain * kGainUnit / 16, 4);
  put(message, 40, image.exposure_lines * Ov7251Emulator::kLine_ns, 8);
  const Bytes pixels = as_grey(image);
  message.insert(message.end(), pixels.begin(), pixels.end());
  // A host that is not fast enough loses this frame.
  if (send(client_, message.data(), message.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(message.size())) {
    sent_.push_back(image);
  }
}

}  // namespace plumb::emulator
