// Flies for hours at full speed. Exit code 0: nothing grew, slipped or differed, 1: something did, 2: bad arguments.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>

#include "config/arguments.h"
#include "test/faults/command_line.h"
#include "test/faults/endurance.h"
#include "test/faults/usage_of_endurance.h"

namespace plumb::faults {
namespace {

using Clock = std::chrono::steady_clock;

void print(const EnduranceReport& report, Clock::time_point start) {
  const double spent_s = std::chrono::duration<double>(Clock::now() - start).count();
  std::printf(
      "%6.0f s flown in %5.0f s: %llu states compared, %llu unequal, memory %.2f MiB, grown %lld bytes, "
      "heap calls %llu, output %.2f to %.2f ms after its sample\n",
      report.flown_s, spent_s, static_cast<unsigned long long>(report.states),
      static_cast<unsigned long long>(report.unequal), static_cast<double>(report.resident_bytes) / 1048576.0,
      static_cast<long long>(report.growth_bytes), static_cast<unsigned long long>(report.heap_calls),
      1e3 * report.shortest_age_s, 1e3 * report.longest_age_s);
  std::fflush(stdout);
}

int main_of(int argc, char** argv) {
  double length_s = 7200.0;
  CLI::App app("", "endurance");
  app.add_option("--seconds", length_s)->check(number_from(10.0, 1e6));
  return run_command_line(app, kUsage, argc, argv, [&length_s] {
    constexpr double kSettled_s = 60.0;
    const Clock::time_point start = Clock::now();
    const EnduranceReport report = fly_endurance(length_s, std::min(kSettled_s, 0.5 * length_s),
                                                 [&](const EnduranceReport& so_far) { print(so_far, start); });
    print(report, start);
    const std::vector<std::string> faults = report.faults();
    for (const std::string& fault : faults) std::fprintf(stderr, "endurance: %s\n", fault.c_str());
    return faults.empty() ? 0 : 1;
  });
}

}  // namespace
}  // namespace plumb::faults

int main(int argc, char** argv) { return plumb::faults::main_of(argc, argv); }
