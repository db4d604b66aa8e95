#pragma once
// The option for what the numbers of a STIM300 are, in the words that every program has for it.

#include <CLI/CLI.hpp>
#include <map>
#include <string>

#include "config/arguments.h"
#include "drivers/stim300/configuration.h"

namespace plumb {

/// `unit`: a stim300::Unit, or std::optional of one. What the driver does not take, a unit is not set up to either.
template <class Value>
void add_unit_option(CLI::App& app, const char* name, Value& unit, const stim300::UnitNames& names, const char* text) {
  std::map<std::string, stim300::Unit> usable;
  for (const stim300::Unit each : {stim300::Unit::kInstant, stim300::Unit::kIncrement, stim300::Unit::kAverage}) {
    usable[names[static_cast<std::size_t>(each)]] = each;
  }
  app.add_option(name, unit, text)->transform(one_of(usable))->type_name("TEXT");
}

}  // namespace plumb
