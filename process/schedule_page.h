#pragma once
// The schedule for people.

#include <string>

namespace plumb {

/// The table of docs/executive.md, in Markdown.
std::string schedule_page();

}  // namespace plumb
