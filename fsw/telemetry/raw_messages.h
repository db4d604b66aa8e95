#pragma once
// What the devices said, as LCM messages: a flight replayed from these goes through the drivers. As messages.h.

#include <cstdint>

#include "fsw/base/fixed_vector.h"
#include "fsw/telemetry/messages.h"

namespace plumb {

namespace channel {
inline constexpr const char* kRawStim300 = "RAW_STIM300";
inline constexpr const char* kRawLidarLite = "RAW_LIDAR_LITE";
inline constexpr const char* kRawCan = "RAW_CAN";
}  // namespace channel

/// What one read of a serial line returned.
struct RawBytes {
  Time t;  ///< arrival of the last byte; without bytes: when the line was silent
  FixedVector<std::uint8_t, 256> bytes;
};

/// One transfer on an I2C bus, START to STOP.
struct RawTransfer {
  Time t_stop;
  Duration duration;
  std::uint8_t address = 0;  ///< 7 bits
  bool is_read = false;
  bool acknowledged = false;
  FixedVector<std::uint8_t, 8> bytes;
};

/// One classic CAN data frame.
struct RawCanFrame {
  Time t;                ///< its end
  std::uint32_t id = 0;  ///< without flags
  bool is_extended = false;
  FixedVector<std::uint8_t, 8> bytes;
};

Result<std::size_t> encode(const RawBytes& raw, MessageBuffer buffer);
Result<std::size_t> encode(const RawTransfer& raw, MessageBuffer buffer);
Result<std::size_t> encode(const RawCanFrame& raw, MessageBuffer buffer);

Status decode(MessageBytes message, RawBytes& raw);
Status decode(MessageBytes message, RawTransfer& raw);
Status decode(MessageBytes message, RawCanFrame& raw);

}  // namespace plumb
