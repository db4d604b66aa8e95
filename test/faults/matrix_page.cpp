#include "test/faults/matrix_page.h"

#include <array>
#include <utility>

namespace plumb::faults {
namespace {

using Named = std::pair<const char*, const Finding*>;

std::array<Named, 6> findings_of(const Verdict& verdict) {
  return {{{"modes", &verdict.modes},
           {"events", &verdict.events},
           {"counts", &verdict.counts},
           {"recovery", &verdict.recovery},
           {"error", &verdict.error},
           {"replay", &verdict.replay}}};
}

std::string cell(const Finding& finding) {
  std::string text = finding.seen;
  if (finding.expected != finding.seen) text += "<br>*" + finding.expected + "*";
  if (!finding.passed) text = "**" + finding.seen + "**<br>*" + finding.expected + "*";
  return text;
}

}  // namespace

std::string text_of(const Verdict& verdict) {
  std::string text = std::string(verdict.passed() ? "PASS " : "FAIL ") + verdict.name + ": " + verdict.what + "\n";
  for (const auto& [name, finding] : findings_of(verdict)) {
    if (finding->expected.empty()) continue;
    text += std::string("  ") + (finding->passed ? " " : "!") + " " + name + ": " + finding->seen;
    if (finding->seen != finding->expected) text += "   [expected " + finding->expected + "]";
    text += "\n";
  }
  return text;
}

std::string page_of(const std::vector<Verdict>& verdicts) {
  std::string page =
      "# Fault matrix\n\n"
      "Written by `tools/faults --out docs/fault_matrix.md`; [executive](executive.md#faults) tells how. In italics "
      "what was\n"
      "expected, where it is not what was seen: limits, and events that may come besides.\n\n"
      "| fault | what happens | modes | events | told by drivers | recovery | error | replay | "
      "|\n|---|---|---|---|---|---|---|---|---|\n";
  for (const Verdict& verdict : verdicts) {
    page += "| `" + verdict.name + "` | " + verdict.what;
    for (const auto& [name, finding] : findings_of(verdict)) page += " | " + cell(*finding);
    page += std::string(" | ") + (verdict.passed() ? "pass" : "**FAIL**") + " |\n";
  }
  return page;
}

}  // namespace plumb::faults
