#pragma once
// Commands to the flight software and its answers, as LCM messages. As messages.h.

#include "fsw/measurement/command.h"
#include "fsw/telemetry/messages.h"

namespace plumb {

namespace channel {
inline constexpr const char* kCommand = "COMMAND";
inline constexpr const char* kCommandAck = "COMMAND_ACK";
}  // namespace channel

struct CommandAck {
  Time t;  ///< end of the tick that took the command
  Command command;
};

/// kInvalidValue: not a command at all. One that is damaged has the verdict kChecksum; any other is kAccepted so far.
Status decode(MessageBytes message, Command& command);
Result<std::size_t> encode(const CommandAck& ack, MessageBuffer buffer);

}  // namespace plumb
