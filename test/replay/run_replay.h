#pragma once
// plumb-replay as its user meets it: arguments in, exit code, text and files out.

#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include "test/support/temporary_folder.h"

namespace plumb::test {

struct ReplayResult {
  int exit_code = -1;
  std::string out;
  std::string error;
};

/// For the shell. The paths of the tests hold no quotes.
inline std::string quoted(const std::filesystem::path& path) {
  return std::string("'").append(path.string()).append("'");
}

/// `before` stands before the program in the shell's command.
inline ReplayResult run_replay(const std::string& arguments, const std::string& before = "") {
  const TemporaryFolder folder;
  const std::filesystem::path out = folder.path() / "out";
  const std::filesystem::path error = folder.path() / "error";
  const std::string command =
      before + PLUMB_REPLAY + " " + arguments + " >" + quoted(out) + " 2>" + quoted(error) + " </dev/null";
  const int status = std::system(command.c_str());
  return {
      .exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1, .out = content_of(out), .error = content_of(error)};
}

}  // namespace plumb::test
