#pragma once
// The configuration of plumb-fsw: one YAML file with devices, calibration and parameters, checked whole before anything
// is started.

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "config/calibration_reader.h"
#include "drivers/can_range/decoder.h"
#include "drivers/can_range/node_status.h"
#include "drivers/lidar_lite/protocol.h"
#include "drivers/ov7251/protocol.h"
#include "drivers/stim300/configuration.h"
#include "fsw/app/nav_job.h"
#include "fsw/app/parameters.h"

namespace plumb {

enum class RangeDevice : std::uint8_t { kNone = 0, kLidarLite, kCan };

struct ImuSetup {
  std::string device;  ///< of the serial line
  stim300::Settings settings;
};

struct CameraSetup {
  std::string device;     ///< of Video4Linux; empty: none
  std::string subdevice;  ///< of the sensor, with exposure and gain; empty: the device has them itself
  std::string socket;     ///< of a program that sends frames; empty: none
  double rate_hz = 30.0;  ///< images a second
  /// The sensor is an OV7251, whose driver sets the exposure and knows the readout. Else the camera does as it likes,
  /// and exposure and readout are what follows.
  bool is_ov7251 = false;
  Duration exposure;  ///< of an image whose source does not tell it
  Duration readout;   ///< from the end of exposure to the stamp of an image that is stamped at its end
  Duration shift;     ///< from the stamp, mid-exposure, to the IMU's clock
  Duration latency;   ///< from the end of readout to this host, for an image that nobody stamped
  CameraTrigger trigger = CameraTrigger::kFreeRun;
  std::uint32_t trigger_control = 0;  ///< of the driver in Video4Linux, see V4l2CameraOptions; 0: none
  // Of the automatic exposure of an OV7251, which is off where `exposure` is above zero.
  Duration longest_exposure = ov7251::Options{}.longest_exposure;
  double target_brightness = ov7251::AutoExposureOptions{}.target;  ///< mean of the image, 255 is full
};

struct RangeSetup {
  RangeDevice kind = RangeDevice::kNone;
  std::string device;  ///< /dev/i2c-N or the name of the CAN interface
  lidar_lite::Options lidar_lite;
  can_range::Options can;
  can_range::NodeStatusOptions node_status;  ///< what Plumb is on a DroneCAN bus
};

/// The threads of plumb-fsw.
enum class FlightThread : std::uint8_t { kImu = 0, kTick, kCamera, kRange, kNav, kLog, kCommand };
inline constexpr std::array<const char*, 7> kFlightThreadNames = {"imu", "tick", "camera", "range",
                                                                  "nav", "log",  "command"};

/// Who may command the flight software over LCM.
enum class CommandAccess : std::uint8_t {
  kOff = 0,
  kLocal,    ///< programs on this host; where that cannot be told from others, nobody
  kNetwork,  ///< whoever reaches the multicast group
};

struct ThreadSetup {
  int priority = 0;  ///< SCHED_FIFO, 1 to 99; 0: none
  int core = -1;     ///< -1: any
};

struct FlightSetup {
  std::string text;     ///< of the file, for the log
  std::string log;      ///< file name; empty: no log
  std::string lcm_url;  ///< empty: no telemetry, no commands
  CommandAccess commands = CommandAccess::kLocal;
  ImuSetup imu;
  CameraSetup camera;
  RangeSetup range;
  Calibration calibration;
  Parameters parameters;
  /// Who reads a device or keeps the beat comes before who computes; what may wait has no priority.
  std::array<ThreadSetup, kFlightThreadNames.size()> threads{{{85}, {80}, {70}, {60}, {50}, {0}, {0}}};
};

/// Everything that is wrong with the file, and with those of Kalibr that it names, is added to `faults`; if that is
/// nothing, the setup can be flown.
FlightSetup read_flight_config(const std::filesystem::path& file, std::vector<std::string>& faults);
/// The same from the text of such a file, as a log has it. Files of Kalibr are not there any more: without them the
/// setup has no calibration, which a log has of its own.
FlightSetup read_flight_config(const std::string& name, const std::string& text, std::vector<std::string>& faults);

}  // namespace plumb
