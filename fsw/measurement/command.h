#pragma once
// What somebody else wants of the flight software.

#include <array>
#include <cstddef>
#include <cstdint>

namespace plumb {

enum class CommandId : std::uint16_t {
  kPing = 1,            ///< nothing but an answer
  kReset = 2,           ///< start the filter and the tracker anew; position and yaw begin at zero
  kSetParameter = 3,    ///< number of the parameter, CRC of the table, value (fsw/app/parameter_change.h)
  kTellParameters = 4,  ///< every parameter in force
};

/// Why a command is carried out or not.
enum class CommandVerdict : std::uint8_t {
  kAccepted = 0,
  kChecksum,  ///< it was damaged on its way
  kUnknown,   ///< no command has this id
  kArgument,  ///< an argument that the command does not have, or of a value that it cannot have
  kRepeated,  ///< the same source sent this sequence number last
  // Of a kSetParameter:
  kOtherTable,  ///< the sender knows another table of parameters
  kOutOfRange,  ///< the value, or it is none of its kind
  kConflict,    ///< it does not fit the values of other parameters (conflicts_in())
  kFixed,       ///< it does not change in flight
};

inline constexpr std::size_t kCommandArguments = 4;

/// A command as it came, whatever it is worth, and what was decided of it.
struct Command {
  std::uint32_t source = 0;    ///< who sends it
  std::uint32_t sequence = 0;  ///< of the source's commands
  std::uint16_t id = 0;        ///< CommandId, if it is one
  std::array<double, kCommandArguments> arguments{};
  CommandVerdict verdict = CommandVerdict::kAccepted;

  bool is(CommandId wanted) const {
    return verdict == CommandVerdict::kAccepted && id == static_cast<std::uint16_t>(wanted);
  }
};

}  // namespace plumb
