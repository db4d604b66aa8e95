#pragma once
// Cuts recorded streams into the InputFrames that the executive would have made: ticks of 4 ms, in each of them the
// samples in total order (time, source, sequence), stamped at or before the end of the tick.

#include <cstddef>
#include <cstdint>
#include <span>

#include "fsw/measurement/input_frame.h"

namespace plumb::replay {

/// 250 Hz, the rate of the executive.
inline constexpr Duration kTick = Duration::from_ms(4);

enum class Stream : std::uint8_t { kImu, kRange, kDirection, kCamera };

class FrameAssembler {
 public:
  /// Each stream increasing in time (of the directions, each source); they must outlive this object.
  FrameAssembler(std::span<const ImuSample> imu, std::span<const RangeSample> range,
                 std::span<const DirectionSample> direction, std::span<const CameraReference> camera);

  /// The next tick that holds anything; empty ones are passed over but counted in InputFrame::tick. kNotReady at the
  /// end, kFull when one tick holds more samples of a kind than an InputFrame can (kMaxImuPerFrame, kMaxRangePerFrame,
  /// kMaxDirectionPerFrame, one image).
  Status next(InputFrame& frame);
  /// After kFull: the stream that had too many samples.
  Stream crowded() const { return crowded_; }

 private:
  Time first_time() const;

  std::span<const ImuSample> imu_;
  std::span<const RangeSample> range_;
  std::span<const DirectionSample> direction_;
  std::span<const CameraReference> camera_;
  Time t_start_;
  Stream crowded_ = Stream::kImu;
};

}  // namespace plumb::replay
