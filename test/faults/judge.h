#pragma once
// A fault, what a flight with it has to look like, and whether it does.

#include <functional>
#include <string>
#include <vector>

#include "test/faults/world.h"

namespace plumb::faults {

/// Seconds of flight, in which every fault is over long before.
inline constexpr double kFlight_s = 25.0;
/// The last seconds, in which the error of the state is looked at.
inline constexpr double kJudged_s = 3.0;
/// Bounds of the error for a flight on camera, IMU and ranges: 1 % of the 20 m flown, and what a hover needs.
inline constexpr double kPosition_m = 0.2;
inline constexpr double kVelocity_m_s = 0.1;
/// A state that says it can be relied on must not be further off than three times what it promises
/// (modes.*_sigma_limit).
inline constexpr double kHonest_m = 3.0;
inline constexpr double kHonest_m_s = 1.5;

using Words = std::vector<std::string>;

/// How a flight ends.
enum class Ending { kRecovers, kNotValid, kNotReliable };

struct Expectation {
  /// From the beginning of the fault on, that at its beginning first. In brackets: may be left out.
  Words modes = {"range-VIO"};
  /// Must be told from then on, changes of mode apart, in any order and number.
  Words events = {};
  /// May be told besides. Anything else must not.
  Words also = {};
  /// What drivers must tell to have counted, as "STIM300 counts checksum_errors". Others of their counters may rise
  /// too.
  Words counts = {};
  /// From the end of the fault until the output is in the last mode, valid and reliable, for good.
  double recovery_s = 0.0;
  /// Other modes than the last that count as recovered.
  Words recovered_in = {};
  double position_m = kPosition_m;
  double velocity_m_s = kVelocity_m_s;
  Ending ending = Ending::kRecovers;
  /// Every bit of every state is that of the flight without a fault.
  bool same_states = false;
  /// The log has everything that a replay needs. Otherwise it says what it lacks.
  bool whole_log = true;
};

struct Fault {
  std::string name;
  std::string what;
  double from_s = 0.0;
  double until_s = 0.0;  ///< at from_s when it does not last
  std::function<void(World&)> begin;
  std::function<void(World&)> end = nullptr;
  Expectation expected = {};
  RangeFinder range_finder = RangeFinder::kCan;
};

/// One thing that was expected, and what was seen.
struct Finding {
  std::string expected;
  std::string seen;
  bool passed = true;
};

struct Verdict {
  std::string name = {};
  std::string what = {};
  Finding modes = {};
  Finding events = {};
  Finding counts = {};    ///< of the drivers
  Finding recovery = {};  ///< in flight time
  Finding error = {};     ///< of the state, after recovery
  Finding replay = {};    ///< of the log
  bool passed() const {
    return modes.passed && events.passed && counts.passed && recovery.passed && error.passed && replay.passed;
  }
};

struct JudgedFlight {
  Verdict verdict;
  std::vector<SeenEvent> events;  ///< all of them
};

/// Flies with the fault and judges the flight. Its log goes to `folder`.
JudgedFlight fly_and_judge(const Fault& fault, const std::filesystem::path& folder);

}  // namespace plumb::faults
