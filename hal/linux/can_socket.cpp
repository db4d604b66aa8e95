#include "hal/linux/can_socket.h"

#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "hal/linux/bounded_receive.h"
#include "hal/linux/monotonic_clock.h"

namespace plumb {
namespace {

// What is asked of the controller. Single bus errors are left out: a bus in trouble has thousands a second, and their
// sum shows in the state.
constexpr can_err_mask_t kErrorsOfInterest =
    CAN_ERR_TX_TIMEOUT | CAN_ERR_CRTL | CAN_ERR_BUSOFF | CAN_ERR_RESTARTED | CAN_ERR_ACK;
// Frames that may be looked through in one call for one that is wanted.
constexpr int kMaxFramesPerCall = 64;
// A frame does not wait longer than this in the socket's queue. A stamp beyond it, or in the future, tells that
// CLOCK_REALTIME was set between reception and reading.
constexpr Duration kOldestStamp = Duration::from_ms(2000);

can_filter to_system(const CanFilter& filter) {
  const canid_t id_mask = filter.is_extended ? CAN_EFF_MASK : CAN_SFF_MASK;
  return {.can_id = (filter.id & id_mask) | (filter.is_extended ? CAN_EFF_FLAG : 0U),
          .can_mask = (filter.mask & id_mask) | CAN_EFF_FLAG | CAN_RTR_FLAG};
}

template <typename T>
bool set_option(int socket, int level, int option, const T& value) {
  return setsockopt(socket, level, option, &value, sizeof value) == 0;
}

}  // namespace

std::unique_ptr<LinuxCanSocket> LinuxCanSocket::open(const std::string& interface_name, std::string& error) {
  std::unique_ptr<LinuxCanSocket> opened(new LinuxCanSocket(interface_name));
  if (opened->connect()) return opened;
  error = interface_name + ": cannot be opened as a CAN interface: " + std::strerror(opened->last_error_);
  return nullptr;
}

LinuxCanSocket::~LinuxCanSocket() {
  if (socket_ >= 0) close(socket_);
}

bool LinuxCanSocket::connect() {
  if (socket_ >= 0) close(socket_);
  overflows_before_ = health_.overflows;
  socket_ = socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, CAN_RAW);
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(if_nametoindex(interface_name_.c_str()));
  // Index 0 would listen on every interface. Filters come before bind, so that nothing unwanted gets in between.
  const bool opened = socket_ >= 0 && address.can_ifindex != 0 && apply_filters({filters_.data(), filter_count_}) &&
                      set_option(socket_, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, kErrorsOfInterest) &&
                      set_option(socket_, SOL_SOCKET, SO_TIMESTAMPNS, 1) &&
                      set_option(socket_, SOL_SOCKET, SO_RXQ_OVFL, 1) &&
                      bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  if (opened) return true;
  last_error_ = errno;
  if (socket_ >= 0) close(socket_);
  socket_ = -1;
  return false;
}

bool LinuxCanSocket::apply_filters(std::span<const CanFilter> filters) {
  std::array<can_filter, kMaxFilters> wanted{};
  std::transform(filters.begin(), filters.end(), wanted.begin(), to_system);
  return setsockopt(socket_, SOL_CAN_RAW, CAN_RAW_FILTER, wanted.data(),
                    static_cast<socklen_t>(filters.size() * sizeof(can_filter))) == 0;
}

Status LinuxCanSocket::set_filters(std::span<const CanFilter> filters) {
  if (filters.size() > kMaxFilters) return Status::kFull;
  if (socket_ >= 0 && !apply_filters(filters)) return failed(errno);
  std::copy(filters.begin(), filters.end(), filters_.begin());
  filter_count_ = filters.size();
  return Status::kOk;
}

Status LinuxCanSocket::failed(int error) {
  last_error_ = error;
  if (error == ENETDOWN) health_.state = CanState::kDown;
  if (error == ENODEV || error == ENXIO) {
    // The interface is gone, and this socket is bound to what no longer exists. One that comes back is another one.
    health_.state = CanState::kDown;
    close(socket_);
    socket_ = -1;
  }
  return Status::kRejected;
}

bool LinuxCanSocket::reopen() {
  if (socket_ >= 0) return true;
  const Time now = clock_now();
  if (now < next_reopen_) return false;
  next_reopen_ = now + kReopenPeriod;
  return connect();
}

void LinuxCanSocket::back_on_bus() {
  if (health_.state == CanState::kBusOff || health_.state == CanState::kDown) ++health_.restarts;
  health_.state = CanState::kActive;
}

void LinuxCanSocket::on_error_frame(const can_frame& frame) {
  health_.error_frames.add(std::int64_t{frame.can_id & CAN_ERR_MASK} << 8U | frame.data[1]);
  if ((frame.can_id & CAN_ERR_RESTARTED) != 0) back_on_bus();
  if ((frame.can_id & CAN_ERR_BUSOFF) != 0) {
    if (health_.state != CanState::kBusOff) ++health_.bus_offs;
    health_.state = CanState::kBusOff;
  } else if ((frame.can_id & CAN_ERR_CRTL) != 0) {
    const std::uint8_t reason = frame.data[1];
    constexpr unsigned kPassive = CAN_ERR_CRTL_RX_PASSIVE | CAN_ERR_CRTL_TX_PASSIVE;
    constexpr unsigned kWarning = CAN_ERR_CRTL_RX_WARNING | CAN_ERR_CRTL_TX_WARNING;
    if ((reason & kPassive) != 0) {
      health_.state = CanState::kPassive;
    } else if ((reason & kWarning) != 0) {
      health_.state = CanState::kWarning;
    } else if ((reason & CAN_ERR_CRTL_ACTIVE) != 0) {
      back_on_bus();
    }
  }
}

// The system stamps by CLOCK_REALTIME, which can be set at any time; the difference between the clocks is taken anew
// for each frame.
Time LinuxCanSocket::stamp(msghdr& message) {
  const Time now = clock_now();
  const Time now_real = clock_now(CLOCK_REALTIME);
  Time stamp = Time::never();
  for (cmsghdr* control = CMSG_FIRSTHDR(&message); control != nullptr; control = CMSG_NXTHDR(&message, control)) {
    if (control->cmsg_level != SOL_SOCKET) continue;
    if (control->cmsg_type == SO_TIMESTAMPNS) {
      timespec received{};
      std::memcpy(&received, CMSG_DATA(control), sizeof received);
      stamp = now - (now_real - to_time(received));
    } else if (control->cmsg_type == SO_RXQ_OVFL) {
      std::uint32_t lost = 0;
      std::memcpy(&lost, CMSG_DATA(control), sizeof lost);
      health_.overflows = overflows_before_ + lost;
    }
  }
  if (stamp <= now && stamp >= now - kOldestStamp) return stamp;
  health_.stamps_mended.add((now - stamp).ns());
  return now;
}

/// kInvalidValue: something that is no data frame was taken; look again.
Result<ReceivedCanFrame> LinuxCanSocket::take() {
  can_frame frame{};
  iovec data{.iov_base = &frame, .iov_len = sizeof frame};
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(timespec)) + CMSG_SPACE(sizeof(std::uint32_t))> control{};
  msghdr message{};
  message.msg_iov = &data;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  const ssize_t size = recvmsg(socket_, &message, 0);
  if (size < 0 && (errno == EAGAIN || errno == EINTR)) return Status::kNotReady;
  if (size < 0) return failed(errno);
  const Time t = stamp(message);
  if (size != CAN_MTU || frame.can_dlc > CAN_MAX_DLEN) return Status::kInvalidValue;
  if ((frame.can_id & CAN_ERR_FLAG) != 0) {
    on_error_frame(frame);
    return Status::kInvalidValue;
  }
  if (health_.state == CanState::kBusOff || health_.state == CanState::kDown) back_on_bus();  // only who is on it hears
  ++health_.received;
  ReceivedCanFrame received{.t = t, .frame = {}};
  received.frame.is_extended = (frame.can_id & CAN_EFF_FLAG) != 0;
  received.frame.id = frame.can_id & (received.frame.is_extended ? CAN_EFF_MASK : CAN_SFF_MASK);
  received.frame.size = frame.can_dlc;
  std::copy_n(frame.data, frame.can_dlc, received.frame.bytes.begin());
  return received;
}

Result<ReceivedCanFrame> LinuxCanSocket::receive(Duration timeout) {
  return receive_within(
      {.timeout = timeout, .reopen_period = kReopenPeriod, .most_looks = kMaxFramesPerCall},
      [this] { return reopen(); }, [this] { return take(); }, [this] { return socket_; });
}

Status LinuxCanSocket::send(const CanFrame& frame) {
  if (frame.size > kCanMaxDataBytes || frame.id > (frame.is_extended ? kCanExtendedIdMask : kCanStandardIdMask)) {
    return Status::kInvalidValue;
  }
  if (health_.state == CanState::kBusOff || !reopen()) return Status::kRejected;
  can_frame out{};
  out.can_id = frame.id | (frame.is_extended ? CAN_EFF_FLAG : 0U);
  out.can_dlc = frame.size;
  std::copy_n(frame.bytes.begin(), frame.size, out.data);
  if (::send(socket_, &out, sizeof out, 0) == static_cast<ssize_t>(sizeof out)) {
    if (health_.state == CanState::kDown) back_on_bus();
    ++health_.sent;
    return Status::kOk;
  }
  if (errno == ENOBUFS || errno == EAGAIN) {
    last_error_ = errno;
    return Status::kFull;
  }
  return failed(errno);
}

}  // namespace plumb
