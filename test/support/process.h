#pragma once
// What a program prints, for tests that hold Plumb against another implementation.

#include <cstdio>
#include <string>

namespace plumb::test {

struct ProgramOutput {
  int exit_status = -1;  ///< as from waitpid; 0 is success
  std::string text;      ///< standard output
};

/// Runs a command of the shell to its end.
inline ProgramOutput output_of(const std::string& command) {
  ProgramOutput output;
  std::FILE* pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) return output;
  char buffer[4096];
  for (std::size_t size = 0; (size = std::fread(buffer, 1, sizeof buffer, pipe)) > 0;) output.text.append(buffer, size);
  output.exit_status = pclose(pipe);
  return output;
}

}  // namespace plumb::test
