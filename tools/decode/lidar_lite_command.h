#pragma once

#include <memory>

#include "tools/decode/command.h"

namespace plumb::decode {

std::unique_ptr<Command> make_lidar_lite_command();

}  // namespace plumb::decode
