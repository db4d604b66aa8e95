#pragma once
// The messages between a camera daemon and FrameSocket. One SOCK_SEQPACKET message each, 48 bytes, little-endian; the
// pixels of a frame follow in the same message. Bytes not named are zero, and ignored.
//
//   all       0 u32 magic 0x4D414350 ("PCAM")   4 u16 version 1   6 u16 kind
//
//   to the flight software
//   1 FRAME   8 i64 stamp_ns (CLOCK_MONOTONIC)   16 u32 sequence   20 u8 stamped at: 0 end of frame, 1 start of
//   exposure,
//             2 the daemon knows no stamp   21 u8 flags: bit 0 image damaged, bit 1 exposure and gain are this image's
//             24 i32 width   28 i32 height   32 i32 stride   36 u32 gain, 1000 = 1x   40 i64 exposure_ns
//             48 pixels, 8 bits each: height rows of stride bytes, of which the last may end with its last pixel
//   2 MODE    8 i64 period_ns   16 i32 width   20 i32 height   24 i64 least and 32 i64 longest exposure_ns
//             40 u32 least and 44 u32 most gain, 1000 = 1x          the answer to START: what the camera does now
//
//   to the daemon
//   3 START   8 i64 period_ns   16 i32 width   20 i32 height   24 u8 trigger: 0 free-running, 1 external
//   4 EXPOSE  8 i64 exposure_ns   16 u32 gain, 1000 = 1x
//   5 STOP

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "fsw/base/status.h"
#include "hal/include/camera_port.h"

namespace plumb {

inline constexpr std::size_t kFrameMessageBytes = 48;  ///< without pixels
using FrameMessage = std::array<std::uint8_t, kFrameMessageBytes>;

enum class FrameMessageKind : std::uint8_t { kFrame = 1, kMode = 2, kStart = 3, kExpose = 4, kStop = 5 };

/// What the camera does, and what can be asked of it.
struct CameraAbilities {
  CameraMode mode;
  Exposure least;
  Exposure most;
};

/// kInvalidValue: no message of this protocol.
Result<FrameMessageKind> kind_of(std::span<const std::uint8_t> message);

// Each takes a message of its kind, by kind_of(). kInvalidValue: what it says cannot be.
/// The image is a view of the message. A stamp that the daemon does not know is CameraStamp::kArrival.
Result<PortFrame> decode_frame(std::span<const std::uint8_t> message);
Result<CameraAbilities> decode_abilities(std::span<const std::uint8_t> message);
Result<CameraMode> decode_start(std::span<const std::uint8_t> message);
Result<Exposure> decode_exposure(std::span<const std::uint8_t> message);

/// Without the pixels.
FrameMessage encode_frame(const PortFrame& frame);
FrameMessage encode_abilities(const CameraAbilities& abilities);
FrameMessage encode_start(const CameraMode& mode);
FrameMessage encode_exposure(const Exposure& exposure);
FrameMessage encode_stop();

}  // namespace plumb
