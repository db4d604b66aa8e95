#pragma once

#include <memory>

#include "tools/decode/command.h"

namespace plumb::decode {

/// plumb-decode stim300: bytes captured from the serial line of a STIM300.
std::unique_ptr<Command> make_stim300_command();

}  // namespace plumb::decode
