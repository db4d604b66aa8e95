#pragma once
// plumb-decode as its user meets it: a file in, CSV, counts and exit code out.

#include <sys/wait.h>

#include <cstdlib>
#include <sstream>
#include <string>
#include <vector>

#include "test/support/temporary_folder.h"

namespace plumb::test {

struct Decoded {
  int exit_code = -1;
  std::vector<std::string> rows;  ///< without the header
  std::string header;
  std::string error;
};

inline Decoded decode(const std::string& arguments) {
  const TemporaryFolder folder;
  const std::string command = std::string(PLUMB_DECODE) + " " + arguments + " >" + (folder.path() / "out").string() +
                              " 2>" + (folder.path() / "error").string() + " </dev/null";
  const int status = std::system(command.c_str());
  Decoded result;
  result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  result.error = content_of(folder.path() / "error");
  std::istringstream out(content_of(folder.path() / "out"));
  std::getline(out, result.header);
  for (std::string line; std::getline(out, line);) result.rows.push_back(line);
  return result;
}

}  // namespace plumb::test
