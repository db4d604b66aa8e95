#include "fsw/telemetry/raw_messages.h"

#include <algorithm>

#include "fsw/telemetry/lcm_codec.h"
#include "plumb_lcm/plumb/can_frame_t.hpp"
#include "plumb_lcm/plumb/i2c_transfer_t.hpp"
#include "plumb_lcm/plumb/raw_bytes_t.hpp"

namespace plumb {
namespace {

template <std::size_t N, std::size_t Room>
void copy(const FixedVector<std::uint8_t, N>& from, std::uint8_t (&to)[Room]) {
  static_assert(N == Room, "raw.lcm has the capacity of the record");
  std::copy(from.begin(), from.end(), to);
}

template <std::size_t Room, std::size_t N>
Status take(const std::uint8_t (&from)[Room], std::int32_t size, FixedVector<std::uint8_t, N>& to) {
  if (size < 0 || size > static_cast<std::int32_t>(N)) return Status::kInvalidValue;
  to.resize(static_cast<std::size_t>(size));
  std::copy_n(from, to.size(), to.begin());
  return Status::kOk;
}

}  // namespace

Result<std::size_t> encode(const RawBytes& raw, MessageBuffer buffer) {
  raw_bytes_t message{};
  message.time_ns = raw.t.ns();
  message.size = static_cast<std::int32_t>(raw.bytes.size());
  copy(raw.bytes, message.bytes);
  return write(message, buffer);
}

Result<std::size_t> encode(const RawTransfer& raw, MessageBuffer buffer) {
  i2c_transfer_t message{};
  message.time_ns = raw.t_stop.ns();
  message.duration_ns = static_cast<std::int32_t>(raw.duration.ns());
  message.address = static_cast<std::int8_t>(raw.address);
  message.is_read = raw.is_read ? 1 : 0;
  message.acknowledged = raw.acknowledged ? 1 : 0;
  message.size = static_cast<std::int8_t>(raw.bytes.size());
  copy(raw.bytes, message.bytes);
  return write(message, buffer);
}

Result<std::size_t> encode(const RawCanFrame& raw, MessageBuffer buffer) {
  can_frame_t message{};
  message.time_ns = raw.t.ns();
  message.id = static_cast<std::int32_t>(raw.id);
  message.is_extended = raw.is_extended ? 1 : 0;
  message.size = static_cast<std::int8_t>(raw.bytes.size());
  copy(raw.bytes, message.bytes);
  return write(message, buffer);
}

Status decode(MessageBytes bytes, RawBytes& raw) {
  raw_bytes_t message{};
  if (!read(bytes, message)) return Status::kInvalidValue;
  raw.t = Time::from_ns(message.time_ns);
  return take(message.bytes, message.size, raw.bytes);
}

Status decode(MessageBytes bytes, RawTransfer& raw) {
  i2c_transfer_t message{};
  if (!read(bytes, message)) return Status::kInvalidValue;
  if (!is_flag(message.is_read) || !is_flag(message.acknowledged) || message.address < 0) return Status::kInvalidValue;
  raw.t_stop = Time::from_ns(message.time_ns);
  raw.duration = Duration::from_ns(message.duration_ns);
  raw.address = static_cast<std::uint8_t>(message.address);
  raw.is_read = message.is_read == 1;
  raw.acknowledged = message.acknowledged == 1;
  return take(message.bytes, message.size, raw.bytes);
}

Status decode(MessageBytes bytes, RawCanFrame& raw) {
  can_frame_t message{};
  if (!read(bytes, message)) return Status::kInvalidValue;
  if (!is_flag(message.is_extended)) return Status::kInvalidValue;
  raw.t = Time::from_ns(message.time_ns);
  raw.id = static_cast<std::uint32_t>(message.id);
  raw.is_extended = message.is_extended == 1;
  return take(message.bytes, message.size, raw.bytes);
}

}  // namespace plumb
