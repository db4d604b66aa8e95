#pragma once
// A subcommand of plumb-decode: one kind of device.

#include <cstdio>
#include <memory>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace plumb::decode {

class Command {
 public:
  virtual ~Command() = default;
  virtual const char* name() const = 0;
  virtual const char* description() const = 0;
  /// Declares its options, which run() finds parsed.
  virtual void declare(CLI::App& app) = 0;
  /// Measurements to standard output as CSV, then one line of counts to standard error. False: no measurement was
  /// printed, and the line before the counts says why. Throws InputError for input in which nothing can be counted.
  virtual bool run() = 0;

 protected:
  /// The line before the counts.
  static void tell_of_none(const std::string& file, const char* question) {
    std::fprintf(stderr, "plumb-decode: %s: no measurement; %s\n", file.c_str(), question);
  }
};

/// Every device that plumb-decode knows; a new one is a line there.
std::vector<std::unique_ptr<Command>> commands();

}  // namespace plumb::decode
