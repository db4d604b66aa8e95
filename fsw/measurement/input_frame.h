#pragma once
// The one gate into the flight software: everything the estimator may depend on, for one tick of the executive.
// Samples stand in total order (time, then source, then sequence). The record is logged before it is used, so the state
// is a function of the initial state and the sequence of InputFrames alone.

#include <cstdint>

#include "fsw/base/fixed_vector.h"
#include "fsw/measurement/samples.h"

namespace plumb {

inline constexpr std::size_t kMaxImuPerFrame = 64;  ///< 2 kHz IMU at a 250 Hz tick, eight times over
inline constexpr std::size_t kMaxRangePerFrame = 16;
inline constexpr std::size_t kMaxDirectionPerFrame = 8;

/// Which camera frame belongs to this tick; the pixels travel beside the record, found by this reference.
struct CameraReference {
  Time t_exposure_mid;
  std::uint32_t sequence = 0;
};

struct InputFrame {
  std::uint64_t tick = 0;  ///< counts from 0 at start-up
  Time t;                  ///< end of the tick's interval: every sample here is stamped at or before it
  FixedVector<ImuSample, kMaxImuPerFrame> imu;
  FixedVector<RangeSample, kMaxRangePerFrame> range;
  FixedVector<DirectionSample, kMaxDirectionPerFrame> direction;
  bool has_camera = false;
  CameraReference camera;
};

}  // namespace plumb
