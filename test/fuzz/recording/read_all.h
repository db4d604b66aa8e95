#pragma once
// What every reader of a recording owes: a message, or every tick.

#include "config/input_error.h"
#include "fsw/base/assert.h"
#include "tools/replay/session.h"

namespace plumb::replay {

/// Reads the source that `open` gives to its end, and `check`s each tick; or it is refused with a message.
template <class Open, class Check>
void read_all(Open open, Check check) {
  try {
    const auto source = open();
    Tick tick;
    while (source->next(tick)) check(tick);
  } catch (const InputError& error) {
    PLUMB_ASSERT(error.what()[0] != '\0');
  }
}

}  // namespace plumb::replay
