#include "process/mode_page.h"

#include "fsw/modes/mode_machine.h"
#include "fsw/modes/sensor_health.h"

namespace plumb {
namespace {

template <class Conditions>
std::string words(ConditionSet set, const Conditions& conditions, const std::string& between) {
  std::string text;
  for (std::size_t bit = 0; bit < conditions.size(); ++bit) {
    if ((set >> bit & 1U) != 0) text += (text.empty() ? "" : between) + std::string(conditions[bit].name);
  }
  return text;
}

template <class Conditions>
std::string words(const Rule& rule, const Conditions& conditions) {
  std::string text = words(rule.all_of, conditions, " and ");
  const auto add = [&text](const std::string& more) { text += (text.empty() ? "" : "; ") + more; };
  if (rule.any_of != 0) add(words(rule.any_of, conditions, " or "));
  if (rule.none_of != 0) add("not " + words(rule.none_of, conditions, ", not "));
  return text;
}

template <class Table, class Conditions>
std::string page(const Table& table, const char* what, const Conditions& conditions) {
  std::string page = "| " + std::string(what) + " | entered when | stays while |\n|---|---|---|\n";
  for (const auto& row : table) {
    page += "| " + std::string(row.name) + " | " + words(row.enter, conditions) + " | " + words(row.stay, conditions) +
            " |\n";
  }
  page += "\n| condition | what holds |\n|---|---|\n";
  for (const ConditionText& condition : conditions) {
    page += "| " + std::string(condition.name) + " | " + std::string(condition.meaning) + " |\n";
  }
  return page;
}

}  // namespace

std::string mode_page() { return page(kModeTable, "mode", kModeConditions); }

std::string sensor_page() { return page(kSensorTable, "sensor", kSensorConditions); }

}  // namespace plumb
