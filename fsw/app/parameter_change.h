#pragma once
// Parameters that change in flight: what a command of id kSetParameter asks for, whether it may, and what it does. Its
// arguments are the number of the parameter, the CRC of the table that has it there, and the value.

#include <cstddef>
#include <optional>

#include "fsw/app/parameters.h"
#include "fsw/measurement/command.h"
#include "fsw/params/param_store.h"

namespace plumb {

using ParameterStore = ParamStore<Parameters>;

/// One parameter that has been set.
struct ParameterChange {
  std::size_t number = 0;  ///< of its row in parameter_table(), from 0
  double before = 0.0;
  double after = 0.0;
};

/// Whether the sender of a kSetParameter knows parameter_table().
bool is_of_this_table(const Command& command);

/// Judges a kSetParameter, and sets it in `staged` when it is accepted: what will be in force when the commands so far
/// are carried out.
CommandVerdict judge_set(const Command& command, Parameters& staged);

/// Carries out a command on what is in force; nothing unless it is an accepted kSetParameter of this table.
std::optional<ParameterChange> carry_out(const Command& command, ParameterStore& store);

}  // namespace plumb
