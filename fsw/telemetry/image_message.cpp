// The image message (image_t in input.lcm), written and read by hand: the generated type keeps its pixels in a vector.

#include <algorithm>

#include "fsw/telemetry/messages.h"

namespace plumb {
namespace {

// What lcm-gen computes for image_t; a test compares the two.
constexpr std::uint64_t kImageFingerprint = 0x15DA05311893E76DU;

// LCM is big-endian.
template <typename T>
std::uint8_t* put(std::uint8_t* at, T value) {
  for (int shift = 8 * (static_cast<int>(sizeof value) - 1); shift >= 0; shift -= 8) {
    *at++ = static_cast<std::uint8_t>(value >> shift);
  }
  return at;
}

template <typename T>
T get(const std::uint8_t*& at) {
  T value = 0;
  for (std::size_t i = 0; i < sizeof value; ++i) value = static_cast<T>((value << 8) | *at++);
  return value;
}

}  // namespace

Result<std::size_t> encode(const CameraFrame& frame, MessageBuffer buffer) {
  const ImageView& image = frame.image;
  if (image.pixels == nullptr || image.width <= 0 || image.height <= 0 || image.stride < image.width) {
    return Status::kInvalidValue;
  }
  const auto width = static_cast<std::size_t>(image.width);
  const auto height = static_cast<std::size_t>(image.height);
  if (buffer.size() < kImageHeaderBytes || height > (buffer.size() - kImageHeaderBytes) / width) return Status::kFull;
  std::uint8_t* at = put(buffer.data(), kImageFingerprint);
  at = put(at, static_cast<std::uint64_t>(frame.t_exposure_mid.ns()));
  at = put(at, frame.sequence);
  at = put(at, static_cast<std::uint32_t>(width));
  at = put(at, static_cast<std::uint32_t>(height));
  at = put(at, static_cast<std::uint32_t>(width * height));
  for (std::size_t row = 0; row < height; ++row) {
    at = std::copy_n(image.pixels + row * static_cast<std::size_t>(image.stride), width, at);
  }
  return kImageHeaderBytes + width * height;
}

Status decode(MessageBytes message, CameraFrame& frame) {
  if (message.size() < kImageHeaderBytes) return Status::kInvalidValue;
  const std::uint8_t* at = message.data();
  if (get<std::uint64_t>(at) != kImageFingerprint) return Status::kInvalidValue;
  const auto time_ns = static_cast<std::int64_t>(get<std::uint64_t>(at));
  const auto sequence = get<std::uint32_t>(at);
  const auto width = get<std::uint32_t>(at);
  const auto height = get<std::uint32_t>(at);
  const auto size = get<std::uint32_t>(at);
  constexpr std::uint32_t kMaxSide = 65536;  // px; keeps the product of the sides well inside 64 bits
  if (width == 0 || height == 0 || width > kMaxSide || height > kMaxSide) return Status::kInvalidValue;
  const std::uint64_t pixels = std::uint64_t{width} * height;
  if (pixels != size || message.size() - kImageHeaderBytes != pixels) return Status::kInvalidValue;
  frame = {.t_exposure_mid = Time::from_ns(time_ns),
           .sequence = sequence,
           .image = {.pixels = at,
                     .width = static_cast<std::int32_t>(width),
                     .height = static_cast<std::int32_t>(height),
                     .stride = static_cast<std::int32_t>(width)}};
  return Status::kOk;
}

}  // namespace plumb
