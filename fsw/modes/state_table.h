#pragma once
// State machines as tables: what is to be known of a state stands in its row, and what has to be true of a table as a
// whole is checked when it is compiled.

#include <cstddef>
#include <cstdint>
#include <iterator>
#include <string_view>

#include "fsw/base/assert.h"

namespace plumb {

/// Conditions that hold, one bit each.
using ConditionSet = std::uint16_t;

/// A condition's name in tables, and what it says.
struct ConditionText {
  std::string_view name;
  std::string_view meaning;
};

struct Rule {
  ConditionSet all_of = 0;
  ConditionSet any_of = 0;  ///< 0: asks for nothing
  ConditionSet none_of = 0;

  constexpr bool holds(ConditionSet facts) const {
    return (facts & all_of) == all_of && (any_of == 0 || (facts & any_of) != 0) && (facts & none_of) == 0;
  }
};

/// A state lasts as long as `stay` holds. Then the first row, from the top, whose `enter` holds has the next one.
template <class State>
struct StateRow {
  State state;
  std::string_view name;
  Rule enter;
  Rule stay;
};

/// The first row that may be entered. Precondition: the table is_sound().
template <class Table>
constexpr auto entered_state(const Table& table, ConditionSet facts) {
  for (const auto& row : table) {
    if (row.enter.holds(facts)) return row.state;
  }
  PLUMB_ASSERT(false);
  return table[0].state;
}

template <class Table, class State>
constexpr State next_state(const Table& table, State now, ConditionSet facts) {
  for (const auto& row : table) {
    if (row.state == now && row.stay.holds(facts)) return now;
  }
  return entered_state(table, facts);
}

/// Whatever holds of `all` conditions: some row may be entered, what is entered is not left at once, and no state lasts
/// where a row above it wants in.
template <class Table>
constexpr bool is_sound(const Table& table, ConditionSet all) {
  for (std::uint32_t facts = 0; facts <= all; ++facts) {
    const auto now = static_cast<ConditionSet>(facts);
    bool above_wants_in = false;
    bool entered = false;
    for (const auto& row : table) {
      if (row.stay.holds(now) && above_wants_in) return false;
      if (row.enter.holds(now) && !entered) {
        if (!row.stay.holds(now)) return false;
        entered = true;
      }
      above_wants_in = above_wants_in || row.enter.holds(now);
    }
    if (!entered) return false;
  }
  return true;
}

}  // namespace plumb
