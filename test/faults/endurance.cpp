#include "test/faults/endurance.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <fstream>
#include <limits>

#include "test/faults/heap_meter.h"
#include "test/faults/world.h"

namespace plumb::faults {
namespace {

constexpr std::int64_t kSlowNav_ns = 20'000'000;  // twice that of the other, within the logical execution time
constexpr int kGrowthPages = 2;
constexpr std::size_t kMostBehind = 2;  // states that one flight has and the other is still at

std::int64_t resident_bytes() {
  std::ifstream file("/proc/self/statm");
  std::int64_t all = 0;
  std::int64_t resident = 0;
  if (!(file >> all >> resident)) throw std::runtime_error("/proc/self/statm cannot be read");
  return resident * sysconf(_SC_PAGESIZE);
}

/// The hashes of two flights, of which neither is ahead by much.
class HashPairs {
 public:
  void add(const World& first, const World& second, EnduranceReport& report) {
    const auto append = [](std::deque<std::uint64_t>& to, const World& world) {
      to.insert(to.end(), world.seen().state_hashes.begin(), world.seen().state_hashes.end());
    };
    append(first_, first);
    append(second_, second);
    for (; !first_.empty() && !second_.empty(); first_.pop_front(), second_.pop_front()) {
      ++report.states;
      if (first_.front() != second_.front()) ++report.unequal;
    }
    if (std::max(first_.size(), second_.size()) > kMostBehind) ++report.unequal;
  }

 private:
  std::deque<std::uint64_t> first_;
  std::deque<std::uint64_t> second_;
};

void look_at(const World& world, EnduranceReport& report) {
  for (const SeenOutput& output : world.seen().outputs) {
    if (!output.valid) continue;  // one that is not may come without a sample
    report.shortest_age_s = std::min(report.shortest_age_s, output.age_s);
    report.longest_age_s = std::max(report.longest_age_s, output.age_s);
  }
}

void count_losses(const World& first, const World& second, EnduranceReport& report) {
  report.slips = report.inputs_lost = report.records_lost = 0;
  for (const World* world : {&first, &second}) {
    for (const FlightJob job : {kJobAssemble, kJobPredict, kJobPublish, kJobHealth})
      report.slips += world->account(job).slips();
    report.inputs_lost += world->inputs_lost();
    report.records_lost += world->log_records_lost();
  }
  report.ticks = first.account(kJobAssemble).runs();
}

}  // namespace

std::vector<std::string> EnduranceReport::faults() const {
  std::vector<std::string> found;
  const auto expect = [&found](bool holds, const std::string& otherwise) {
    if (!holds) found.push_back(otherwise);
  };
  expect(states > 0, "no state was compared");
  expect(unequal == 0, std::to_string(unequal) + " of " + std::to_string(states) + " hashes are unequal");
  expect(growth_bytes <= kGrowthPages * sysconf(_SC_PAGESIZE),
         "memory has grown by " + std::to_string(growth_bytes) + " bytes");
  expect(longest_age_s - shortest_age_s <= kTickPeriod.seconds(),
         "outputs do not keep their distance from their samples: " + std::to_string(1e3 * shortest_age_s) + " to " +
             std::to_string(1e3 * longest_age_s) + " ms");
  const double periods = flown_s / kTickPeriod.seconds();
  expect(std::abs(static_cast<double>(ticks) - periods) <= 1.0 + 1e-3 * periods,
         std::to_string(ticks) + " ticks, expected " + std::to_string(static_cast<std::uint64_t>(periods)));
  expect(slips == 0, std::to_string(slips) + " periods without a run of a job");
  expect(inputs_lost == 0, std::to_string(inputs_lost) + " inputs lost");
  expect(records_lost == 0, std::to_string(records_lost) + " log records lost");
  expect(heap_calls == 0, std::to_string(heap_calls) + " heap calls of the flight tasks");
  return found;
}

EnduranceReport fly_endurance(double length_s, double settled_s,
                              const std::function<void(const EnduranceReport&)>& progress) {
  // Everything goes through the queues and the writer of the log; a file of two hours has 11 GB.
  World first("/dev/null");
  World second("/dev/null");
  second.host().nav_time_ns = kSlowNav_ns;
  EnduranceReport report;
  report.shortest_age_s = std::numeric_limits<double>::max();
  HashPairs hashes;
  std::int64_t settled_bytes = 0;
  std::uint64_t settled_calls = 0;
  for (int second_number = 1; report.flown_s < length_s; ++second_number) {
    report.flown_s = std::min(static_cast<double>(second_number), length_s);
    for (World* world : {&first, &second}) {
      world->fly_until(report.flown_s);
      look_at(*world, report);
    }
    hashes.add(first, second, report);
    first.forget_seen();
    second.forget_seen();
    forget_images();
    report.resident_bytes = resident_bytes();
    if (report.flown_s <= settled_s) {
      settled_bytes = report.resident_bytes;
      settled_calls = heap_meter().calls();
    }
    report.heap_calls = heap_meter().calls() - settled_calls;
    report.growth_bytes = report.resident_bytes - settled_bytes;
    count_losses(first, second, report);
    constexpr int kProgressPeriod_s = 60;
    if (second_number % kProgressPeriod_s == 0) progress(report);
  }
  first.finish();
  second.finish();
  return report;
}

}  // namespace plumb::faults
