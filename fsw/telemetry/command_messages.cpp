#include "fsw/telemetry/command_messages.h"

#include <algorithm>

#include "fsw/base/crc32.h"
#include "fsw/telemetry/lcm_codec.h"
#include "plumb_lcm/plumb/command_ack_t.hpp"
#include "plumb_lcm/plumb/command_t.hpp"

namespace plumb {

Status decode(MessageBytes bytes, Command& command) {
  command_t message{};
  if (!read(bytes, message)) return Status::kInvalidValue;
  const std::uint32_t crc = crc32(bytes.first(bytes.size() - sizeof message.crc));
  const bool whole = crc == static_cast<std::uint32_t>(message.crc);
  command.source = static_cast<std::uint32_t>(message.source);
  command.sequence = static_cast<std::uint32_t>(message.sequence);
  command.id = static_cast<std::uint16_t>(message.id);
  std::copy(std::begin(message.arguments), std::end(message.arguments), command.arguments.begin());
  command.verdict = whole ? CommandVerdict::kAccepted : CommandVerdict::kChecksum;
  return Status::kOk;
}

Result<std::size_t> encode(const CommandAck& ack, MessageBuffer buffer) {
  command_ack_t message{};
  message.time_ns = ack.t.ns();
  message.source = static_cast<std::int32_t>(ack.command.source);
  message.sequence = static_cast<std::int32_t>(ack.command.sequence);
  message.id = static_cast<std::int16_t>(ack.command.id);
  message.verdict = static_cast<std::int8_t>(ack.command.verdict);
  return write(message, buffer);
}

}  // namespace plumb
