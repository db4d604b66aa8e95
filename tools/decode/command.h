#pragma once
// A subcommand of plumb-decode: one kind of device.

#include <memory>
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
  /// Measurements to standard output as CSV, then one line of counts to standard error. Throws InputError for
  /// what is wrong with the input.
  virtual void run() = 0;
};

/// Every device that plumb-decode knows; a new one is a line there.
std::vector<std::unique_ptr<Command>> commands();

}  // namespace plumb::decode
