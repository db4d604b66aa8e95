#pragma once
// The end of a program's main(): arguments in, exit code out.

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>

#include "fsw/base/assert.h"

namespace plumb::faults {

/// Reads the arguments and runs. `usage`: the help. The exit code of that; 2 for bad arguments, 1 for an exception,
/// each told on standard error.
template <typename Run>
int run_command_line(CLI::App& app, const char* usage, int argc, char** argv, Run run) {
  const auto tell = [&app](const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", app.get_name().c_str(), error.what());
  };
  set_assert_handler([](const AssertSite& site) {
    std::fprintf(stderr, "bug: %s line %d: %s does not hold\n", site.file, site.line, site.condition);
  });
  try {
    app.parse(argc, argv);
    return run();
  } catch (const CLI::CallForHelp&) {
    return std::puts(usage) < 0 ? 1 : 0;
  } catch (const CLI::ParseError& error) {
    tell(error);
    return 2;
  } catch (const std::exception& error) {
    tell(error);
    return 1;
  }
}

}  // namespace plumb::faults
