#pragma once
// What encoders and decoders of all message types do alike. For the sources of this folder.

#include <algorithm>

#include "fsw/telemetry/messages.h"

namespace plumb {

template <class Message>
Result<std::size_t> write(const Message& message, MessageBuffer buffer) {
  const auto room = static_cast<int>(std::min(buffer.size(), kMaxMessageBytes));
  const int written = message.encode(buffer.data(), 0, room);
  if (written < 0) return Status::kFull;
  return static_cast<std::size_t>(written);
}

/// The generated decoder checks type and length; bytes left over mean that it is not such a message either.
template <class Message>
bool read(MessageBytes bytes, Message& message) {
  if (bytes.size() > kMaxMessageBytes) return false;
  const auto size = static_cast<int>(bytes.size());
  return message.decode(bytes.data(), 0, size) == size;
}

inline bool is_flag(std::int8_t value) { return value == 0 || value == 1; }

}  // namespace plumb
