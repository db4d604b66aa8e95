#include "hal/linux/frame_socket.h"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>

#include "hal/linux/bounded_receive.h"
#include "hal/linux/monotonic_clock.h"

namespace plumb {
namespace {

// Messages that may be looked through in one call for one that is a frame.
constexpr int kMaxMessagesPerCall = 64;

}  // namespace

std::unique_ptr<FrameSocket> FrameSocket::open(const std::string& path, std::string& error) {
  std::unique_ptr<FrameSocket> opened(new FrameSocket(path));
  const int reason = opened->connect();
  if (reason == 0) return opened;
  error = path + ": no camera daemon there: " + std::strerror(reason);
  return nullptr;
}

int FrameSocket::connect() {
  disconnect();
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path_.size() >= sizeof address.sun_path) return ENAMETOOLONG;
  std::copy(path_.begin(), path_.end(), address.sun_path);
  socket_ = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (socket_ < 0 || ::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    const int error = errno;
    disconnect();
    return error;
  }
  return 0;
}

void FrameSocket::disconnect() {
  if (socket_ >= 0) close(socket_);
  socket_ = -1;
  has_abilities_ = false;
}

Status FrameSocket::failed(int error) {
  last_error_ = error;
  disconnect();
  next_reopen_ = clock_now() + kReopenPeriod;
  return Status::kRejected;
}

Status FrameSocket::send(const FrameMessage& message) {
  if (socket_ < 0) return Status::kRejected;
  if (::send(socket_, message.data(), message.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(message.size())) {
    return Status::kOk;
  }
  return failed(errno);  // a daemon that does not read is none
}

Status FrameSocket::begin() {
  if (const Status sent = send(encode_start(mode_)); !ok(sent)) return sent;
  return exposure_.time > Duration() ? send(encode_exposure(exposure_)) : Status::kOk;
}

bool FrameSocket::come_back() {
  if (socket_ >= 0) return true;
  if (clock_now() < next_reopen_) return false;
  if (const int error = connect(); error != 0) {
    (void)failed(error);
    return false;
  }
  if (!ok(begin())) return false;
  stream_.restart();
  return true;
}

Result<CameraMode> FrameSocket::start(const CameraMode& mode) {
  if (mode.width <= 0 || mode.height <= 0 || mode.period <= Duration()) return Status::kInvalidValue;
  mode_ = mode;
  wanted_ = true;
  stream_.start();
  if (socket_ < 0) {
    if (const int error = connect(); error != 0) return failed(error);
  }
  has_abilities_ = false;
  if (const Status begun = begin(); !ok(begun)) return begun;
  const Time deadline = clock_now() + kAnswerTimeout;
  for (int looked = 0; looked < kMaxMessagesPerCall; ++looked) {
    const Result<PortFrame> taken = take();  // frames before the answer are of the mode before
    if (taken.status() == Status::kRejected) return Status::kRejected;
    if (has_abilities_ && (abilities_.mode.width != mode.width || abilities_.mode.height != mode.height)) {
      stop();
      return Status::kInvalidValue;
    }
    if (has_abilities_) return abilities_.mode;
    if (taken.status() != Status::kNotReady) continue;
    const Duration left = deadline - clock_now();
    if (left <= Duration()) break;
    (void)wait_for(socket_, POLLIN, left);
  }
  return failed(ETIMEDOUT);
}

void FrameSocket::stop() {
  if (wanted_) (void)send(encode_stop());  // a daemon that is gone has stopped
  wanted_ = false;
}

/// kInvalidValue: what was taken is no frame; look again.
Result<PortFrame> FrameSocket::take() {
  iovec data{.iov_base = message_.data(), .iov_len = message_.size()};
  msghdr header{};
  header.msg_iov = &data;
  header.msg_iovlen = 1;
  const ssize_t size = recvmsg(socket_, &header, 0);
  if (size < 0 && (errno == EAGAIN || errno == EINTR)) return Status::kNotReady;
  if (size <= 0) return failed(size == 0 ? ENODEV : errno);  // no bytes: the daemon has closed
  const Time now = clock_now();
  ImageView image_told;
  const auto message = std::span<const std::uint8_t>(message_).first(static_cast<std::size_t>(size));
  const bool is_whole = (header.msg_flags & MSG_TRUNC) == 0;
  const Result<FrameMessageKind> kind = kind_of(message);
  if (is_whole && kind && *kind == FrameMessageKind::kMode) {
    if (const Result<CameraAbilities> told = decode_abilities(message); told) {
      abilities_ = *told;
      has_abilities_ = true;
      return Status::kInvalidValue;
    }
  } else if (is_whole && kind && *kind == FrameMessageKind::kFrame) {
    const Result<PortFrame> decoded = decode_frame(message);
    if (decoded && decoded->image.width == mode_.width && decoded->image.height == mode_.height) {
      PortFrame frame = *decoded;
      stream_.on_frame(frame, frame.stamp != CameraStamp::kArrival, now);
      return frame;
    }
    if (decoded) image_told = decoded->image;
  }
  stream_.on_malformed(message.size(), image_told);
  return Status::kInvalidValue;
}

Result<PortFrame> FrameSocket::receive(Duration timeout) {
  if (!wanted_) return Status::kOutOfOrder;
  return receive_within(
      {.timeout = timeout, .reopen_period = kReopenPeriod, .most_looks = kMaxMessagesPerCall},
      [this] { return come_back(); }, [this] { return take(); }, [this] { return socket_; });
}

Result<Exposure> FrameSocket::set_exposure(const Exposure& wanted) {
  if (!can_be_asked_for(wanted)) return Status::kInvalidValue;
  exposure_ = wanted;
  if (has_abilities_) {
    exposure_.time = std::clamp(wanted.time, abilities_.least.time, abilities_.most.time);
    exposure_.gain = std::clamp(wanted.gain, abilities_.least.gain, abilities_.most.gain);
  }
  if (const Status sent = send(encode_exposure(exposure_)); !ok(sent)) return sent;
  return exposure_;
}

}  // namespace plumb
