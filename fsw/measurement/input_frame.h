#pragma once
// The one gate into the flight software: everything the estimator may depend on, for one tick of the executive.
// Samples stand in total order (time, then source, then sequence). The record is logged before it is used, so the state
// is a function of the initial state and the sequence of InputFrames alone.

#include <cstdint>

#include "fsw/base/fixed_vector.h"
#include "fsw/measurement/command.h"
#include "fsw/measurement/samples.h"

namespace plumb {

inline constexpr std::size_t kMaxImuPerFrame = 64;  ///< 2 kHz IMU at a 250 Hz tick, eight times over
inline constexpr std::size_t kMaxRangePerFrame = 16;
inline constexpr std::size_t kMaxDirectionPerFrame = 8;
inline constexpr std::size_t kMaxCommandsPerFrame = 4;  ///< more wait for the next tick

/// Which camera frame belongs to this tick; the pixels travel beside the record, found by this reference.
struct CameraReference {
  Time t_exposure_mid;
  std::uint32_t sequence = 0;
};

/// When the newest result of the nav job reaches the output, in this tick. What depends on how fast the machine is
/// becomes an input here, so that a replay need not be as fast.
enum class Handover : std::uint8_t {
  kAtOnce = 0,  ///< in the tick that processes the image: a recording that no executive has flown
  kHeld,        ///< nothing in this tick: no result, or its logical execution time is not over
  kReleased,    ///< in this tick, before its samples are used
  kLate,        ///< the result was due in this tick and was not there; a later tick releases it
};

struct InputFrame {
  std::uint64_t tick = 0;  ///< counts from 0 at start-up
  Time t;                  ///< end of the tick's interval: every sample here is stamped at or before it
  Handover handover = Handover::kAtOnce;
  bool image_skipped = false;  ///< the nav job was busy and another image waited: `camera` is not used
  bool nav_missed = false;     ///< the queue to the nav job was full: it does not get this frame at all
  FixedVector<ImuSample, kMaxImuPerFrame> imu;
  FixedVector<RangeSample, kMaxRangePerFrame> range;
  FixedVector<DirectionSample, kMaxDirectionPerFrame> direction;
  FixedVector<Command, kMaxCommandsPerFrame> commands;  ///< carried out before the samples are used
  bool has_camera = false;
  CameraReference camera;
};

}  // namespace plumb
