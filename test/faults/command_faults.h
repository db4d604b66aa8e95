#pragma once
// Faults of commands and of the parameters that they set.

#include <vector>

#include "test/faults/judge.h"

namespace plumb::faults {

/// Whole, without arguments.
void send_command(World& world, int sequence, CommandId id);

void add_command_faults(std::vector<Fault>& rows);

}  // namespace plumb::faults
