#pragma once
// The modes and the health of sensors for people.

#include <string>

namespace plumb {

/// The tables of docs/executive.md, in Markdown: of modes, and of a sensor's states.
std::string mode_page();
std::string sensor_page();

}  // namespace plumb
