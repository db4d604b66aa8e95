#include "test/faults/judge.h"

#include <algorithm>
#include <cstdio>

#include "fsw/modes/mode_machine.h"
#include "test/support/process.h"

namespace plumb::faults {
namespace {

std::string joined(const Words& words, const char* between) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : between) + word;
  return text.empty() ? "none" : text;
}

bool has(const Words& words, const std::string& word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

template <class... Values>
std::string printed(const char* format, Values... values) {
  char text[200];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

std::string name_of(NavMode mode) {
  for (const auto& row : kModeTable) {
    if (row.state == mode) return std::string(row.name);
  }
  return "unknown";
}

bool is_optional(const std::string& mode) { return mode.starts_with("("); }
std::string bare(const std::string& mode) { return is_optional(mode) ? mode.substr(1, mode.size() - 2) : mode; }

bool matches(const Words& modes, const Words& expected) {
  std::size_t next = 0;
  for (const std::string& mode : expected) {
    if (next < modes.size() && modes[next] == bare(mode)) {
      ++next;
    } else if (!is_optional(mode)) {
      return false;
    }
  }
  return next == modes.size();
}

Finding judge_modes(const Fault& fault, const SeenFlight& seen) {
  Words modes;
  for (const SeenOutput& output : seen.outputs) {
    const std::string mode = name_of(output.mode);
    if (output.t_s < fault.from_s) {
      modes = {mode};
    } else if (modes.empty() || modes.back() != mode) {
      modes.push_back(mode);
    }
  }
  return {.expected = joined(fault.expected.modes, " > "),
          .seen = joined(modes, " > "),
          .passed = matches(modes, fault.expected.modes)};
}

bool is_count(const SeenEvent& event) { return event.words.find(kCounts) != std::string::npos; }

Finding judge_events(const Fault& fault, const SeenFlight& seen) {
  const Expectation& expected = fault.expected;
  Words told;
  bool passed = true;
  for (const SeenEvent& event : seen.events) {
    if (event.t_s < fault.from_s || event.words.starts_with("mode ") || is_count(event) || has(told, event.words))
      continue;
    told.push_back(event.words);
    passed = passed && (has(expected.events, event.words) || has(expected.also, event.words));
  }
  for (const std::string& event : expected.events) passed = passed && has(told, event);
  const std::string also = expected.also.empty() ? "" : " (perhaps " + joined(expected.also, ", ") + ")";
  return {.expected = joined(expected.events, ", ") + also, .seen = joined(told, ", "), .passed = passed};
}

Finding judge_counts(const Fault& fault, const SeenFlight& seen) {
  Words told;
  for (const SeenEvent& event : seen.events) {
    if (event.t_s >= fault.from_s && is_count(event) && !has(told, event.words)) told.push_back(event.words);
  }
  bool passed = fault.begin != nullptr || told.empty();
  for (const std::string& counter : fault.expected.counts) passed = passed && has(told, counter);
  const Words& expected = fault.expected.counts.empty() && passed ? told : fault.expected.counts;
  return {.expected = joined(expected, ", "), .seen = joined(told, ", "), .passed = passed};
}

Finding judge_recovery(const Fault& fault, const SeenFlight& seen) {
  const Expectation& expected = fault.expected;
  const double until_s = std::max(fault.from_s, fault.until_s);
  if (expected.ending != Ending::kRecovers) {
    const bool invalid = expected.ending == Ending::kNotValid;
    const SeenOutput& last = seen.outputs.back();
    const bool passed = invalid ? !last.valid : last.reliable_for_s == 0.0;
    const std::string ending = invalid ? "ends not valid" : "ends not reliable";
    return {.expected = ending, .seen = passed ? ending : "ends as if it could be relied on", .passed = passed};
  }
  double t_bad_s = 0.0;
  for (const SeenOutput& output : seen.outputs) {
    const bool good =
        output.valid && output.reliable_for_s > 0.0 &&
        (bare(expected.modes.back()) == name_of(output.mode) || has(expected.recovered_in, name_of(output.mode)));
    if (!good) t_bad_s = output.t_s;
  }
  const bool never = seen.outputs.empty() || t_bad_s == seen.outputs.back().t_s;
  const double recovery_s = std::max(0.0, t_bad_s - until_s);
  return {.expected = printed("%.2f s", expected.recovery_s),
          .seen = never ? "never" : printed("%.2f s", recovery_s),
          .passed = !never && recovery_s <= expected.recovery_s};
}

Finding judge_error(const Fault& fault, const SeenFlight& seen, const SeenFlight* without) {
  const Expectation& expected = fault.expected;
  double worst_m = 0.0;
  double worst_m_s = 0.0;
  double relied_on_m = 0.0;
  double relied_on_m_s = 0.0;
  for (const SeenOutput& output : seen.outputs) {
    if (!output.valid) continue;
    if (output.reliable_for_s > 0.0) {
      relied_on_m = std::max(relied_on_m, output.position_error_m);
      relied_on_m_s = std::max(relied_on_m_s, output.velocity_error_m_s);
    }
    if (output.t_s < kFlight_s - kJudged_s) continue;
    worst_m = std::max(worst_m, output.position_error_m);
    worst_m_s = std::max(worst_m_s, output.velocity_error_m_s);
  }
  Finding finding{.expected = printed("%.2f m, %.2f m/s", expected.position_m, expected.velocity_m_s),
                  .seen = printed("%.3f m, %.3f m/s", worst_m, worst_m_s),
                  .passed = worst_m <= expected.position_m && worst_m_s <= expected.velocity_m_s};
  if (expected.ending != Ending::kRecovers)
    finding = {.expected = "none to act on", .seen = "none to act on", .passed = true};
  if (relied_on_m > kHonest_m || relied_on_m_s > kHonest_m_s) {
    finding.passed = false;
    finding.seen += printed("; while it called itself reliable %.1f m, %.1f m/s", relied_on_m, relied_on_m_s);
  }
  if (without == nullptr) return finding;
  finding.expected += ", bits as without a fault";
  if (without->state_hashes != seen.state_hashes) {
    finding.passed = false;
    finding.seen += ", other bits";
  } else {
    finding.seen += ", the same bits";
  }
  return finding;
}

std::string replayed(const std::filesystem::path& log, const char* how) {
  const test::ProgramOutput run = test::output_of(std::string(PLUMB_REPLAY) + " --log " + log.string() + how + " 2>&1");
  if (run.exit_status == 0 && run.text.find(", all equal") != std::string::npos) return "equal";
  return run.text.find("gaps") != std::string::npos ||
                 run.text.find("is not before the INPUT_FRAME") != std::string::npos
             ? "says what is missing"
             : "not equal: " + run.text.substr(0, 300);
}

Finding judge_replay(const Fault& fault, const std::filesystem::path& log) {
  const std::string expected = fault.expected.whole_log ? "equal" : "says what is missing";
  const std::string frames = replayed(log, "");
  const std::string bytes = replayed(log, " --raw");
  return {.expected = expected,
          .seen = frames == bytes ? frames : "frames " + frames + ", bytes " + bytes,
          .passed = frames == expected && bytes == expected};
}

const SeenFlight& flight_without_fault(const std::filesystem::path& folder) {
  static SeenFlight seen;
  if (seen.outputs.empty()) {
    World world(folder / "without.lcm");
    world.fly(kFlight_s, {});
    seen = world.seen();
  }
  return seen;
}

}  // namespace

JudgedFlight fly_and_judge(const Fault& fault, const std::filesystem::path& folder) {
  const std::filesystem::path log = folder / (fault.name + ".lcm");
  World world(log, fault.range_finder);
  std::vector<Action> actions;
  if (fault.begin) actions.push_back({.t_s = fault.from_s, .act = fault.begin});
  if (fault.end) actions.push_back({.t_s = fault.until_s, .act = fault.end});
  world.fly(kFlight_s, std::move(actions));
  const SeenFlight& seen = world.seen();
  const Verdict verdict{
      .name = fault.name,
      .what = fault.what,
      .modes = judge_modes(fault, seen),
      .events = judge_events(fault, seen),
      .counts = judge_counts(fault, seen),
      .recovery = judge_recovery(fault, seen),
      .error = judge_error(fault, seen, fault.expected.same_states ? &flight_without_fault(folder) : nullptr),
      .replay = judge_replay(fault, log)};
  return {.verdict = verdict, .events = seen.events};
}

}  // namespace plumb::faults
