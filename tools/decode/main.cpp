// plumb-decode: bytes captured from a device to measurements. Exit code 0 done, whatever the bytes were like, as long
// as there was a measurement in them; 1 results that could not be written or an internal failure; 2 bad input.

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <memory>
#include <string>
#include <vector>

#include "config/input_error.h"
#include "fsw/base/assert.h"
#include "tools/decode/command.h"

namespace plumb::decode {
namespace {

constexpr int kExitFailed = 1;
constexpr int kExitBadInput = 2;

void print_assertion(const AssertSite& site) {
  std::fprintf(stderr, "plumb-decode: bug: %s line %d: %s does not hold\n", site.file, site.line, site.condition);
}

std::string kinds(const std::vector<std::unique_ptr<Command>>& all, int argc, char** argv) {
  std::string names;
  for (const std::unique_ptr<Command>& command : all) names += std::string(names.empty() ? "" : ", ") + command->name();
  return std::string(argc > 1 ? "'" + std::string(argv[1]) + "' is no kind of device" : "no kind of device is given") +
         "; expected one of " + names;
}

int run(int argc, char** argv) {
  set_assert_handler(print_assertion);
  CLI::App app(
      "Decodes bytes captured from a device: measurements as CSV on standard output, counts on standard error.",
      "plumb-decode");
  app.require_subcommand(1);
  const std::vector<std::unique_ptr<Command>> all = commands();
  for (const std::unique_ptr<Command>& command : all) {
    CLI::App* const subcommand = app.add_subcommand(command->name(), command->description());
    command->declare(*subcommand);
  }
  bool measured = true;
  try {
    app.parse(argc, argv);
    for (const std::unique_ptr<Command>& command : all) {
      if (app.got_subcommand(command->name())) measured = command->run();
    }
  } catch (const CLI::CallForHelp& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    const bool knows_kind = !app.get_subcommands().empty();
    std::fprintf(stderr, "plumb-decode: %s\n", knows_kind ? error.what() : kinds(all, argc, argv).c_str());
    return kExitBadInput;
  } catch (const InputError& error) {
    std::fprintf(stderr, "plumb-decode: %s\n", error.what());
    return kExitBadInput;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "plumb-decode: internal failure: %s\n", error.what());
    return kExitFailed;
  }
  if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0) {
    std::fprintf(stderr, "plumb-decode: standard output: writing failed; is the disk full?\n");
    return kExitFailed;
  }
  return measured ? 0 : kExitBadInput;
}

}  // namespace
}  // namespace plumb::decode

int main(int argc, char** argv) { return plumb::decode::run(argc, argv); }
