#pragma once
// CanSocket on Linux's SocketCAN. Bit rate and restart after bus-off are set where the interface is set up, not here:
//   ip link set can0 type can bitrate 1000000 restart-ms 100 && ip link set can0 up

#include <memory>
#include <string>

#include "hal/include/can_socket.h"

struct can_frame;
struct msghdr;

namespace plumb {

class LinuxCanSocket final : public CanSocket {
 public:
  static constexpr std::size_t kMaxFilters = 8;
  /// A socket whose interface went away is opened again no more often than this.
  static constexpr Duration kReopenPeriod = Duration::from_ms(100);

  /// Opens the interface ("can0") and lets no data frame through until filters are set. Null, and the reason in
  /// `error`, when there is no such interface.
  static std::unique_ptr<LinuxCanSocket> open(const std::string& interface_name, std::string& error);
  ~LinuxCanSocket() override;
  LinuxCanSocket(const LinuxCanSocket&) = delete;
  LinuxCanSocket& operator=(const LinuxCanSocket&) = delete;

  Status set_filters(std::span<const CanFilter> filters) override;
  Result<ReceivedCanFrame> receive(Duration timeout) override;
  Status send(const CanFrame& frame) override;
  const CanHealth& health() const override { return health_; }
  int last_error() const override { return last_error_; }

 private:
  explicit LinuxCanSocket(std::string interface_name) : interface_name_(std::move(interface_name)) {}
  bool connect();
  bool apply_filters(std::span<const CanFilter> filters);
  Status failed(int error);
  bool reopen();
  Result<ReceivedCanFrame> take();
  void on_error_frame(const can_frame& frame);
  Time stamp(msghdr& message);
  void back_on_bus();

  std::string interface_name_;
  int socket_ = -1;
  std::array<CanFilter, kMaxFilters> filters_{};
  std::size_t filter_count_ = 0;
  Time next_reopen_;
  std::uint32_t overflows_before_ = 0;  ///< of sockets closed since
  CanHealth health_;
  int last_error_ = 0;
};

}  // namespace plumb
