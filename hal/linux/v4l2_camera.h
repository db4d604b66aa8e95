#pragma once
// CameraPort on Video4Linux: single- and multi-planar capture into buffers that the driver shares with this process.
// Links and pad formats of a media graph are set where the system is set up, not here (docs/sensors.md).
//
// Video4Linux has no timeouts. start(), set_exposure(), and receive() where it brings back a camera that was gone, are
// a bounded number of system calls: to start some thirty and three for each buffer, for each of three formats. Each
// takes as long as the driver takes, which talks to its sensor over I2C or USB, and gives up when the timeout of that
// bus is over. So a camera needs a thread that nobody waits for; the supervisor of plumb-fsw tells when it does not get
// round.

#include <memory>
#include <string>
#include <vector>

#include "hal/include/camera_port.h"
#include "hal/linux/frame_stream.h"
#include "hal/linux/v4l2_device.h"

namespace plumb {

struct V4l2CameraOptions {
  std::string device = "/dev/video0";
  /// Sub-device that has exposure, gain and frame interval, as "/dev/v4l-subdev0"; empty: the device has them itself.
  std::string sensor{};
  /// One step of V4L2_CID_EXPOSURE, whose unit is the driver's own: a line of the sensor, for the OV7251. A driver
  /// without it may have V4L2_CID_EXPOSURE_ABSOLUTE, as that of USB cameras, whose unit is always 100 us.
  Duration exposure_step = Duration::from_ns(19'333);
  double gain_step = 1.0 / 16.0;  ///< one step of V4L2_CID_GAIN or V4L2_CID_ANALOGUE_GAIN
  /// Control of the sensor's driver that is 1 for an external trigger and 0 for none; 0: it has no such control.
  std::uint32_t trigger_control = 0;
};

class V4l2Camera final : public CameraPort {
 public:
  /// One is lent out by receive(); the others take what comes meanwhile.
  static constexpr std::uint32_t kBuffers = 6;
  /// A camera that went away is opened again no more often than this.
  static constexpr Duration kReopenPeriod = Duration::from_ms(100);

  /// Opens the device. Null, and the reason in `error`, when it is not there, no camera, or cannot stream.
  static std::unique_ptr<V4l2Camera> open(const V4l2CameraOptions& options, std::string& error);

  Result<CameraMode> start(const CameraMode& mode) override;
  void stop() override;
  Result<PortFrame> receive(Duration timeout) override;
  Result<Exposure> set_exposure(const Exposure& wanted) override;
  const CameraHealth& health() const override { return stream_.health(); }
  int last_error() const override { return last_error_; }

  /// Of the pixels as the driver delivers them. Meaningless before start().
  GreyFormat format() const { return agreed_.format; }

 private:
  explicit V4l2Camera(V4l2CameraOptions options) : options_(std::move(options)) {}
  int connect();
  int begin();
  int configure(GreyFormat format);
  void go_away(int error);
  bool come_back();
  Result<PortFrame> take();
  CameraStamp stamp_of(std::uint32_t flags) const;
  int find_exposure_controls(V4l2Control& time, V4l2Control& gain) const;
  Result<Exposure> apply(const Exposure& wanted);
  const DeviceFile& controls() const { return sensor_.is_open() ? sensor_ : capture_.file(); }

  V4l2CameraOptions options_;
  V4l2Capture capture_;
  DeviceFile sensor_;
  RawImage agreed_;  ///< with the driver; without bytes
  std::vector<std::uint8_t> unpacked_;
  CameraMode mode_;
  Exposure exposure_;    ///< asked for last; no time: not yet
  int lent_ = -1;        ///< buffer whose image the caller sees
  bool wanted_ = false;  ///< between start() and stop()
  bool streaming_ = false;
  Time next_reopen_;
  FrameStream stream_;
  int last_error_ = 0;
};

}  // namespace plumb
