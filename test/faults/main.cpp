// Runs the fault matrix. Exit code 0: every fault ends as expected, 1: one does not, 2: bad arguments.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <fstream>
#include <stdexcept>

#include "test/faults/command_line.h"
#include "test/faults/fault_table.h"
#include "test/faults/matrix_page.h"
#include "test/faults/process_faults.h"
#include "test/faults/usage_of_faults.h"
#include "test/support/temporary_folder.h"

namespace plumb::faults {
namespace {

struct Arguments {
  bool list = false;
  bool events = false;
  std::vector<std::string> only;
  std::string out;
  std::string keep;
};

bool is_wanted(const Arguments& arguments, const std::string& name) {
  return arguments.only.empty() ||
         std::find(arguments.only.begin(), arguments.only.end(), name) != arguments.only.end();
}

int run(const Arguments& arguments) {
  const std::vector<Fault> flight = flight_faults();
  const std::vector<ProcessFault> process = process_faults();
  std::vector<std::string> unknown = arguments.only;
  const auto known = [&](const std::string& name, const std::string& what) {
    std::erase(unknown, name);
    if (arguments.list) std::printf("%-22s %s\n", name.c_str(), what.c_str());
  };
  for (const Fault& fault : flight) known(fault.name, fault.what);
  for (const ProcessFault& fault : process) known(fault.name, fault.what);
  if (!unknown.empty()) throw CLI::ValidationError("--only", "no fault is named '" + unknown.front() + "'; see --list");
  if (arguments.list) return 0;
  // Before the flights, which take minutes; another page in its place stays until there is a new one.
  if (!arguments.out.empty() && !std::ofstream(arguments.out, std::ios::app)) {
    throw CLI::ValidationError("--out", arguments.out + ": cannot be written; expected the path of a file");
  }

  const test::TemporaryFolder folder;
  const std::filesystem::path logs = arguments.keep.empty() ? folder.path() : std::filesystem::path(arguments.keep);
  std::filesystem::create_directories(logs);
  std::vector<Verdict> verdicts;
  const auto add = [&](const Verdict& verdict) {
    verdicts.push_back(verdict);
    std::printf("%s", text_of(verdict).c_str());
    std::fflush(stdout);
  };
  for (const Fault& fault : flight) {
    if (!is_wanted(arguments, fault.name)) continue;
    const JudgedFlight flown = fly_and_judge(fault, logs);
    add(flown.verdict);
    for (const SeenEvent& event : flown.events) {
      if (arguments.events) std::printf("    %8.3f s %s\n", event.t_s, event.words.c_str());
    }
    if (arguments.keep.empty()) std::filesystem::remove(logs / (fault.name + ".lcm"));
  }
  for (const ProcessFault& fault : process) {
    if (!is_wanted(arguments, fault.name)) continue;
    const test::TemporaryFolder room;
    add(run_and_judge(fault, room.path()));
  }
  const auto failed = std::count_if(verdicts.begin(), verdicts.end(), [](const Verdict& v) { return !v.passed(); });
  std::printf("%zu faults, %zu as expected\n", verdicts.size(), verdicts.size() - static_cast<std::size_t>(failed));
  if (!arguments.out.empty()) {
    std::ofstream page(arguments.out);
    page << page_of(verdicts);
    if (!page.flush()) throw std::runtime_error(arguments.out + ": cannot be written");
  }
  return failed == 0 ? 0 : 1;
}

int main_of(int argc, char** argv) {
  Arguments arguments;
  CLI::App app("", "faults");
  app.add_flag("--list", arguments.list);
  app.add_flag("--events", arguments.events);
  app.add_option("--only", arguments.only)->delimiter(',');
  app.add_option("--out", arguments.out);
  app.add_option("--keep", arguments.keep);
  return run_command_line(app, kUsage, argc, argv, [&arguments] { return run(arguments); });
}

}  // namespace
}  // namespace plumb::faults

int main(int argc, char** argv) { return plumb::faults::main_of(argc, argv); }
