#include "tools/replay/frame_assembler.h"

#include <algorithm>

namespace plumb::replay {
namespace {

// Moves the samples up to t from the head of the stream into the frame.
template <typename T, std::size_t N>
Status take(std::span<const T>& stream, Time t, FixedVector<T, N>& into) {
  into.clear();
  while (!stream.empty() && stream.front().t <= t) {
    if (!ok(into.push_back(stream.front()))) return Status::kFull;
    stream = stream.subspan(1);
  }
  return Status::kOk;
}

}  // namespace

FrameAssembler::FrameAssembler(std::span<const ImuSample> imu, std::span<const RangeSample> range,
                               std::span<const DirectionSample> direction, std::span<const CameraReference> camera)
    : imu_(imu), range_(range), direction_(direction), camera_(camera), t_start_(first_time()) {}

Time FrameAssembler::first_time() const {
  Time first = Time::max();
  if (!imu_.empty()) first = std::min(first, imu_.front().t);
  if (!range_.empty()) first = std::min(first, range_.front().t);
  if (!direction_.empty()) first = std::min(first, direction_.front().t);
  if (!camera_.empty()) first = std::min(first, camera_.front().t_exposure_mid);
  return first;
}

Status FrameAssembler::next(InputFrame& frame) {
  const Time first = first_time();
  if (first == Time::max()) return Status::kNotReady;
  // Tick k ends k * 4 ms after the first sample of the recording; a sample on the boundary belongs to the tick it ends.
  const std::int64_t since_start_ns = (first - t_start_).ns();
  const std::int64_t tick = since_start_ns / kTick.ns() + (since_start_ns % kTick.ns() > 0 ? 1 : 0);
  frame.tick = static_cast<std::uint64_t>(tick);
  frame.t = t_start_ + kTick * tick;
  crowded_ = Stream::kImu;
  if (!ok(take(imu_, frame.t, frame.imu))) return Status::kFull;
  crowded_ = Stream::kRange;
  if (!ok(take(range_, frame.t, frame.range))) return Status::kFull;
  crowded_ = Stream::kDirection;
  if (!ok(take(direction_, frame.t, frame.direction))) return Status::kFull;
  crowded_ = Stream::kCamera;
  frame.has_camera = !camera_.empty() && camera_.front().t_exposure_mid <= frame.t;
  frame.camera = {};
  if (!frame.has_camera) return Status::kOk;
  frame.camera = camera_.front();
  camera_ = camera_.subspan(1);
  const bool second = !camera_.empty() && camera_.front().t_exposure_mid <= frame.t;
  return second ? Status::kFull : Status::kOk;
}

}  // namespace plumb::replay
