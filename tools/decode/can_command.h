#pragma once

#include <memory>

#include "tools/decode/command.h"

namespace plumb::decode {

std::unique_ptr<Command> make_can_command();

}  // namespace plumb::decode
