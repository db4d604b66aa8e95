#pragma once
// What is sent when, for people.

#include <string>

namespace plumb {

/// The table of docs/interface.md, in Markdown.
std::string telemetry_page();

}  // namespace plumb
