#pragma once
// CameraPort on frames that a camera daemon of the board hands over through a Unix socket, for boards whose sensor has
// no plain Video4Linux device, and hosts without a camera. The daemon listens on a SOCK_SEQPACKET socket at a path and
// speaks the messages of frame_message.h. It should send without waiting, and drop a frame that the socket does not
// take: the gap then shows in the sequence. No call waits for the daemon but start() and receive(), as long as they
// say: connecting to it takes no time or fails. A message of 640 x 480 px needs SO_SNDBUF set to 212992, the usual
// maximum.

#include <memory>
#include <string>
#include <vector>

#include "hal/include/camera_port.h"
#include "hal/linux/frame_message.h"
#include "hal/linux/frame_stream.h"

namespace plumb {

class FrameSocket final : public CameraPort {
 public:
  /// Pixels and strides of 1024 x 1024 px.
  static constexpr std::size_t kMaxMessageBytes = kFrameMessageBytes + (std::size_t{1} << 20);
  /// A daemon that went away is looked for no more often than this.
  static constexpr Duration kReopenPeriod = Duration::from_ms(100);
  /// start() waits so long for the daemon's answer.
  static constexpr Duration kAnswerTimeout = Duration::from_ms(1000);

  /// Connects to the daemon at `path`. Null, and the reason in `error`, when nobody listens there.
  static std::unique_ptr<FrameSocket> open(const std::string& path, std::string& error);
  ~FrameSocket() override { disconnect(); }
  FrameSocket(const FrameSocket&) = delete;
  FrameSocket& operator=(const FrameSocket&) = delete;

  Result<CameraMode> start(const CameraMode& mode) override;
  void stop() override;
  Result<PortFrame> receive(Duration timeout) override;
  /// Returns what was asked for within the limits that the daemon told; what it took shows in the frames.
  Result<Exposure> set_exposure(const Exposure& wanted) override;
  const CameraHealth& health() const override { return stream_.health(); }
  int last_error() const override { return last_error_; }

 private:
  explicit FrameSocket(std::string path) : path_(std::move(path)), message_(kMaxMessageBytes) {}
  int connect();
  void disconnect();
  Status begin();
  Status failed(int error);
  bool come_back();
  Status send(const FrameMessage& message);
  Result<PortFrame> take();

  std::string path_;
  int socket_ = -1;
  std::vector<std::uint8_t> message_;
  CameraMode mode_;
  CameraAbilities abilities_;
  bool has_abilities_ = false;  ///< the daemon has answered
  Exposure exposure_;           ///< asked for last; no time: not yet
  bool wanted_ = false;         ///< between start() and stop()
  Time next_reopen_;
  FrameStream stream_;
  int last_error_ = 0;
};

}  // namespace plumb
