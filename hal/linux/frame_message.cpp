#include "hal/linux/frame_message.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "hal/linux/grey_image.h"

namespace plumb {
namespace {

static_assert(std::endian::native == std::endian::little, "messages are copied as they lie in memory");

constexpr std::uint32_t kMagic = 0x4D41'4350;
constexpr std::uint16_t kVersion = 1;
constexpr std::uint8_t kFlagDamaged = 1;
constexpr std::uint8_t kFlagExposureTold = 2;
constexpr double kGainUnits = 1000.0;

template <typename T>
T get(std::span<const std::uint8_t> message, std::size_t offset) {
  T value{};
  std::memcpy(&value, message.subspan(offset, sizeof value).data(), sizeof value);
  return value;
}

template <typename T>
void put(FrameMessage& message, std::size_t offset, T value) {
  std::memcpy(std::span(message).subspan(offset, sizeof value).data(), &value, sizeof value);
}

FrameMessage message_of(FrameMessageKind kind) {
  FrameMessage message{};
  put(message, 0, kMagic);
  put(message, 4, kVersion);
  put(message, 6, static_cast<std::uint16_t>(kind));
  return message;
}

void put_gain(FrameMessage& message, std::size_t offset, double gain) {
  constexpr double kMost = std::numeric_limits<std::uint32_t>::max();
  put(message, offset, static_cast<std::uint32_t>(std::clamp(std::round(gain * kGainUnits), 0.0, kMost)));
}

Exposure get_exposure(std::span<const std::uint8_t> message, std::size_t time_offset, std::size_t gain_offset) {
  return {.time = Duration::from_ns(get<std::int64_t>(message, time_offset)),
          .gain = get<std::uint32_t>(message, gain_offset) / kGainUnits};
}

CameraMode get_mode(std::span<const std::uint8_t> message) {
  return {.width = get<std::int32_t>(message, 16),
          .height = get<std::int32_t>(message, 20),
          .period = Duration::from_ns(get<std::int64_t>(message, 8))};
}

void put_mode(FrameMessage& message, const CameraMode& mode) {
  put(message, 8, mode.period.ns());
  put(message, 16, mode.width);
  put(message, 20, mode.height);
}

bool can_be(const CameraMode& mode) { return mode.width > 0 && mode.height > 0 && mode.period > Duration(); }
bool can_be(const Exposure& exposure) { return exposure.time > Duration() && exposure.gain > 0.0; }

}  // namespace

Result<FrameMessageKind> kind_of(std::span<const std::uint8_t> message) {
  if (message.size() < kFrameMessageBytes || get<std::uint32_t>(message, 0) != kMagic ||
      get<std::uint16_t>(message, 4) != kVersion) {
    return Status::kInvalidValue;
  }
  const auto kind = get<std::uint16_t>(message, 6);
  const bool is_known = kind >= static_cast<std::uint16_t>(FrameMessageKind::kFrame) &&
                        kind <= static_cast<std::uint16_t>(FrameMessageKind::kStop);
  if (!is_known) return Status::kInvalidValue;
  return static_cast<FrameMessageKind>(kind);
}

Result<PortFrame> decode_frame(std::span<const std::uint8_t> message) {
  const auto stamp = get<std::uint8_t>(message, 20);
  const auto flags = get<std::uint8_t>(message, 21);
  if (stamp > static_cast<std::uint8_t>(CameraStamp::kArrival)) return Status::kInvalidValue;
  std::vector<std::uint8_t> none;  // grey pixels stay where they are
  const Result<ImageView> image = to_grey({.format = GreyFormat::kGrey,
                                           .width = get<std::int32_t>(message, 24),
                                           .height = get<std::int32_t>(message, 28),
                                           .stride = get<std::int32_t>(message, 32),
                                           .bytes = message.subspan(kFrameMessageBytes)},
                                          none);
  if (!image) return image.status();
  PortFrame frame{.image = *image,
                  .t = Time::from_ns(get<std::int64_t>(message, 8)),
                  .stamp = static_cast<CameraStamp>(stamp),
                  .sequence = get<std::uint32_t>(message, 16),
                  .damaged = (flags & kFlagDamaged) != 0,
                  .has_exposure = (flags & kFlagExposureTold) != 0,
                  .exposure = get_exposure(message, 40, 36)};
  if (frame.has_exposure && !can_be(frame.exposure)) return Status::kInvalidValue;
  return frame;
}

Result<CameraAbilities> decode_abilities(std::span<const std::uint8_t> message) {
  const CameraAbilities abilities{
      .mode = get_mode(message), .least = get_exposure(message, 24, 40), .most = get_exposure(message, 32, 44)};
  const bool ordered = abilities.least.time <= abilities.most.time && abilities.least.gain <= abilities.most.gain;
  if (!can_be(abilities.mode) || !can_be(abilities.least) || !ordered) return Status::kInvalidValue;
  return abilities;
}

Result<CameraMode> decode_start(std::span<const std::uint8_t> message) {
  CameraMode mode = get_mode(message);
  const auto trigger = get<std::uint8_t>(message, 24);
  if (!can_be(mode) || trigger > static_cast<std::uint8_t>(CameraTrigger::kExternal)) return Status::kInvalidValue;
  mode.trigger = static_cast<CameraTrigger>(trigger);
  return mode;
}

Result<Exposure> decode_exposure(std::span<const std::uint8_t> message) {
  const Exposure exposure = get_exposure(message, 8, 16);
  if (!can_be(exposure)) return Status::kInvalidValue;
  return exposure;
}

FrameMessage encode_frame(const PortFrame& frame) {
  FrameMessage message = message_of(FrameMessageKind::kFrame);
  put(message, 8, frame.t.ns());
  put(message, 16, frame.sequence);
  put(message, 20, static_cast<std::uint8_t>(frame.stamp));
  put(message, 21,
      static_cast<std::uint8_t>((frame.damaged ? kFlagDamaged : 0) | (frame.has_exposure ? kFlagExposureTold : 0)));
  put(message, 24, frame.image.width);
  put(message, 28, frame.image.height);
  put(message, 32, frame.image.stride);
  put_gain(message, 36, frame.exposure.gain);
  put(message, 40, frame.exposure.time.ns());
  return message;
}

FrameMessage encode_abilities(const CameraAbilities& abilities) {
  FrameMessage message = message_of(FrameMessageKind::kMode);
  put_mode(message, abilities.mode);
  put(message, 24, abilities.least.time.ns());
  put(message, 32, abilities.most.time.ns());
  put_gain(message, 40, abilities.least.gain);
  put_gain(message, 44, abilities.most.gain);
  return message;
}

FrameMessage encode_start(const CameraMode& mode) {
  FrameMessage message = message_of(FrameMessageKind::kStart);
  put_mode(message, mode);
  put(message, 24, static_cast<std::uint8_t>(mode.trigger));
  return message;
}

FrameMessage encode_exposure(const Exposure& exposure) {
  FrameMessage message = message_of(FrameMessageKind::kExpose);
  put(message, 8, exposure.time.ns());
  put_gain(message, 16, exposure.gain);
  return message;
}

FrameMessage encode_stop() { return message_of(FrameMessageKind::kStop); }

}  // namespace plumb
