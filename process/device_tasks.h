#pragma once
// The threads that read the devices: bytes and images in, stamped samples into the rings. They do no maths.

#include <array>
#include <atomic>
#include <cstdint>
#include <optional>
#include <vector>

#include "config/flight_config.h"
#include "drivers/can_range/node_status.h"
#include "drivers/can_range/receiver.h"
#include "drivers/lidar_lite/device.h"
#include "drivers/ov7251/device.h"
#include "drivers/stim300/device.h"
#include "fsw/app/sensor_rings.h"
#include "hal/include/camera_port.h"
#include "hal/include/clock.h"
#include "hal/linux/lcm_source.h"
#include "process/recording_ports.h"

namespace plumb {

/// How long a device that is gone is left alone before it is asked again.
inline constexpr Duration kDevicePause = Duration::from_ms(100);

/// Why a device is away: each reason of the system counts once until it is back.
class AwayCounter {
 public:
  /// `error`: errno, of meaning while it is away.
  void look(bool is_away, int error) {
    const int reason = is_away ? error : 0;
    if (reason != 0 && reason != reason_) counter_.add(reason);
    reason_ = reason;
  }
  const FaultCounter& counter() const { return counter_; }

 private:
  int reason_ = 0;
  FaultCounter counter_;
};

class ImuTask {
 public:
  /// All must outlive the task. `wake_tick`: the tick is driven by the samples.
  ImuTask(SerialPort& port, const stim300::Settings& settings, SensorRings& rings, Clock& clock, Clock& wake_tick,
          LogSink& log)
      : port_(port, log), device_(port_, settings), rings_(rings), clock_(clock), wake_tick_(wake_tick) {}

  void run_once();
  /// Any thread.
  std::uint64_t samples() const { return samples_.load(std::memory_order_relaxed); }
  /// Its own thread, or when that has ended; as in kStim300Faults.
  std::array<FaultCounter, kStim300Faults.size()> faults() const;
  /// Any thread. Whether the unit is set up as expected.
  stim300::State state() const { return state_.load(std::memory_order_relaxed); }

 private:
  static constexpr Duration kReadTimeout = Duration::from_ms(20);

  RecordingSerialPort port_;
  stim300::Device device_;
  SensorRings& rings_;
  Clock& clock_;
  Clock& wake_tick_;
  stim300::Samples completed_;
  std::atomic<std::uint64_t> samples_{0};
  std::atomic<stim300::State> state_{stim300::State::kUnconfigured};
  AwayCounter away_;
  DeviceFaultReport<kStim300Faults.size()> report_{FaultyDevice::kStim300, rings_.imu_faults};
};

class LidarLiteTask {
 public:
  LidarLiteTask(I2cBus& bus, const lidar_lite::Options& options, SensorRings& rings, Clock& clock, LogSink& log)
      : bus_(bus, clock, log), device_(bus_, options), rings_(rings), clock_(clock) {}

  void run_once();
  std::uint64_t samples() const { return samples_.load(std::memory_order_relaxed); }
  /// Its own thread, or when that has ended; as in kLidarLiteFaults.
  std::array<FaultCounter, kLidarLiteFaults.size()> faults() const;

 private:
  RecordingI2cBus bus_;
  lidar_lite::Device device_;
  SensorRings& rings_;
  Clock& clock_;
  std::atomic<std::uint64_t> samples_{0};
  AwayCounter away_;
  DeviceFaultReport<kLidarLiteFaults.size()> report_{FaultyDevice::kLidarLite, rings_.range_faults};
};

/// Listens to the range finder, and is a node on a DroneCAN bus itself.
class CanRangeTask {
 public:
  CanRangeTask(CanSocket& socket, const RangeSetup& setup, SensorRings& rings, Clock& clock, LogSink& log);

  void run_once();
  std::uint64_t samples() const { return samples_.load(std::memory_order_relaxed); }
  /// Its own thread, or when that has ended; as in kCanRangeFaults.
  std::array<FaultCounter, kCanRangeFaults.size()> faults() const;

 private:
  static constexpr Duration kReceiveTimeout = Duration::from_ms(50);

  void tell_status();

  RecordingCanSocket socket_;
  can_range::Receiver receiver_;
  std::optional<can_range::NodeStatusBroadcast> node_status_;
  SensorRings& rings_;
  Clock& clock_;
  bool started_ = false;
  std::atomic<std::uint64_t> samples_{0};
  FaultCounter status_not_sent_;
  AwayCounter away_;
  DeviceFaultReport<kCanRangeFaults.size()> report_{FaultyDevice::kCanRange, rings_.range_faults};
};

/// Receives commands. Not a device, but a thread that only brings something in all the same.
class CommandTask {
 public:
  CommandTask(LcmSource& source, SensorRings& rings, Clock& clock) : source_(source), rings_(rings), clock_(clock) {}

  void run_once();
  /// When its thread has ended. On the channel, but no command.
  std::uint64_t not_commands() const { return not_commands_; }
  /// When its thread has ended. Failures of LCM, with errno.
  const FaultCounter& failures() const { return failures_; }

 private:
  static constexpr Duration kReceiveTimeout = Duration::from_ms(100);

  LcmSource& source_;
  SensorRings& rings_;
  Clock& clock_;
  std::uint64_t not_commands_ = 0;
  FaultCounter failures_;
};

struct CameraTaskCounters {
  FaultCounter wrong_size;
  /// The image before once more, by its stamp or by every pixel though it is not of one grey: noise makes that
  /// impossible, so the camera or the link repeats itself. It would look like a standstill.
  FaultCounter repeated;
  FaultCounter no_slot;  ///< every place in the store was taken: the tick task does not come round
};

class CameraTask {
 public:
  CameraTask(CameraPort& port, const CameraSetup& setup, const CameraCalibration& calibration, SensorRings& rings,
             Clock& clock, LogSink& log);

  void run_once();
  std::uint64_t images() const { return images_.load(std::memory_order_relaxed); }
  /// Its own thread, or when that has ended; as in kCameraFaults.
  std::array<FaultCounter, kCameraFaults.size()> faults() const;

 private:
  static constexpr Duration kReceiveTimeout = Duration::from_ms(50);

  Status start();
  Result<CameraFrame> next_frame();
  void accept(const CameraFrame& frame);
  bool is_repeated(const CameraFrame& frame) const;
  Time mid_exposure(const PortFrame& frame) const;

  CameraPort& port_;
  std::optional<ov7251::Device> ov7251_;
  CameraSetup setup_;
  std::int32_t width_;
  std::int32_t height_;
  SensorRings& rings_;
  Clock& clock_;
  LogSink& log_;
  std::vector<std::uint8_t> message_;  ///< allocated once
  bool started_ = false;
  bool has_slot_ = false;
  std::uint8_t slot_ = 0;  ///< empty, and this thread's
  /// Own count: that of a camera which restarts begins anew, and a log knows images by it.
  std::uint32_t sequence_ = 0;
  Time t_last_ = Time::never();  ///< of the image that message_ holds
  CameraTaskCounters counters_;
  AwayCounter away_;
  DeviceFaultReport<kCameraFaults.size()> report_{FaultyDevice::kCamera, rings_.camera_faults};
  std::atomic<std::uint64_t> images_{0};
};

}  // namespace plumb
