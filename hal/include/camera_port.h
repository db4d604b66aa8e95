#pragma once
// A camera that streams grey images: mode and exposure in, frames out, and how the stream is doing.

#include <cstdint>

#include "fsw/base/fault_counter.h"
#include "fsw/base/status.h"
#include "fsw/base/time.h"
#include "fsw/measurement/samples.h"

namespace plumb {

/// What begins an exposure.
enum class CameraTrigger : std::uint8_t {
  kFreeRun = 0,  ///< the sensor's own period
  kExternal,     ///< an edge at the sensor's input; the period is what the edges are expected at
};

struct CameraMode {
  std::int32_t width = 640;                         ///< px
  std::int32_t height = 480;                        ///< px
  Duration period = Duration::from_ns(33'333'333);  ///< from frame to frame
  CameraTrigger trigger = CameraTrigger::kFreeRun;

  friend bool operator==(const CameraMode&, const CameraMode&) = default;
};

struct Exposure {
  Duration time;      ///< during which the pixels collect light
  double gain = 1.0;  ///< analogue and digital together; 1 is the sensor's least

  friend bool operator==(const Exposure&, const Exposure&) = default;
};

/// What a time stamp was taken at.
enum class CameraStamp : std::uint8_t {
  kEndOfFrame = 0,   ///< the last row had been read out
  kStartOfExposure,  ///< the pixels began to collect light
  kArrival,  ///< the source stamps by no clock that is known here: this host had the frame, some time after its end
  kEndOfExposure,  ///< the pixels had collected their light, and the first row was read out
};

/// One image as it came.
struct PortFrame {
  /// Valid until the next call of receive(), start() or stop().
  ImageView image;
  Time t;  ///< on the flight clock; of what, `stamp` says
  CameraStamp stamp = CameraStamp::kEndOfFrame;
  std::uint32_t sequence = 0;  ///< of the source; whether it counts images that were lost depends on the source
  bool damaged = false;        ///< the source says that the image is not whole
  bool has_exposure = false;   ///< the source tells the exposure of this very image
  Exposure exposure{};         ///< meaningless without has_exposure
};

struct CameraHealth {
  std::uint32_t received = 0;  ///< frames returned, damaged ones included
  FaultCounter missed;         ///< sequence numbers left out between two frames. Value: how many the last time
  /// Frames whose sequence number, the value, was not above the last; returned all the same.
  FaultCounter out_of_order;
  FaultCounter damaged;  ///< returned with `damaged` set. Value: sequence number
  /// Of another size or format than agreed on: not returned. Value: width and height [px] that it tells, 32 bits each;
  /// 0 and its bytes where it is no image at all.
  FaultCounter malformed;
  /// Stamps by another clock, in the future or too old: CameraStamp::kArrival. Value: age that the stamp told [ns].
  FaultCounter stamps_mended;
  std::uint32_t restarts = 0;  ///< returns after the camera was gone
  /// Starts and returns at which the camera did not take the exposure set last, and streams with one that nobody asked
  /// for. Value: the system's error number (errno).
  FaultCounter exposures_lost;
};

class CameraPort {
 public:
  virtual ~CameraPort() = default;

  /// Sets the mode and starts the stream; a stream that runs is stopped first. Returns the mode that the camera took,
  /// whose period may be another. Exposure and gain are then those set last, which it counts where the camera does not
  /// take them, or the camera's own. kInvalidValue: the camera has no such mode. kRejected: it is not there or failed;
  /// receive() then tries again by itself.
  virtual Result<CameraMode> start(const CameraMode& mode) = 0;
  virtual void stop() = 0;
  /// The oldest frame not taken yet, waiting for one at most `timeout`; zero or less does not wait. kNotReady: none
  /// came. kRejected: the camera is gone or failed; later calls try to come back by themselves, and one that does takes
  /// as long as opening the camera and starting it, beyond `timeout`: the implementation states what bounds that.
  /// kOutOfOrder: the stream was not started.
  virtual Result<PortFrame> receive(Duration timeout) = 0;

  /// Asks for an exposure, which is moved into the camera's limits and steps, with as much light in the image, time
  /// times gain. Returns what the camera took; images follow it one or two frames later. kRejected: as receive(); it is
  /// set when the camera comes back, and until then the exposure time is as it was, though the gain may not be.
  /// kInvalidValue: not above zero, or not finite.
  virtual Result<Exposure> set_exposure(const Exposure& wanted) = 0;

  virtual const CameraHealth& health() const = 0;
  /// The system's error number (errno) of the last call that failed; 0 when none has.
  virtual int last_error() const = 0;
};

}  // namespace plumb
