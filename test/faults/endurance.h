#pragma once
// A long flight at full speed, twice side by side: the second computer takes twice as long for an image. What must not
// change over hours: memory, the time from a sample to its output, and that both come to the same bits.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace plumb::faults {

struct EnduranceReport {
  double flown_s = 0.0;       ///< simulated
  std::uint64_t states = 0;   ///< of the first flight that the second was compared with
  std::uint64_t unequal = 0;  ///< whose hash differs
  std::int64_t resident_bytes = 0;
  std::int64_t growth_bytes = 0;  ///< of resident memory, since it was first looked at
  double shortest_age_s = 0.0;    ///< of an output's sample, when the output was told
  double longest_age_s = 0.0;
  std::uint64_t ticks = 0;
  std::uint64_t slips = 0;        ///< of any job of the tick, both flights
  std::uint64_t inputs_lost = 0;  ///< both flights, as the next
  std::uint64_t records_lost = 0;
  std::uint64_t heap_calls = 0;  ///< of the flight tasks, since `settled_s`

  /// In sentences; empty when it passed.
  std::vector<std::string> faults() const;
};

/// Flies `length_s`; memory counts from `settled_s` on. `progress` is told how it stands once every simulated minute.
/// Throws std::runtime_error.
EnduranceReport fly_endurance(double length_s, double settled_s,
                              const std::function<void(const EnduranceReport&)>& progress);

}  // namespace plumb::faults
