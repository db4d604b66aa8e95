#pragma once
// What the values of a program's options may be, for CLI11. A refusal names the option, the value and what was
// expected.

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <map>
#include <sstream>
#include <string>

namespace plumb {

/// A number from `min` to `max`. CLI11's own ranges let not-a-number pass.
inline CLI::Validator number_from(double min, double max) {
  std::ostringstream expected;
  expected.precision(10);  // 1000000, not 1e+06
  expected << "a number from " << min << " to " << max;
  const auto check = [min, max, expected = expected.str()](const std::string& text) -> std::string {
    char* end = nullptr;
    const double value = std::strtod(text.c_str(), &end);
    if (!text.empty() && *end == '\0' && value >= min && value <= max) return "";
    return "'" + text + "' refused; expected " + expected;
  };
  return {check, ""};
}

/// One of the names, in whatever case, which becomes the enumerator behind it: for Option::transform().
template <class Value>
CLI::Validator one_of(const std::map<std::string, Value>& names) {
  const auto transform = [names](std::string& text) -> std::string {
    if (const auto at = names.find(CLI::detail::to_lower(text)); at != names.end()) {
      text = std::to_string(static_cast<int>(at->second));
      return "";
    }
    std::string expected;
    for (const auto& [name, value] : names) expected += (expected.empty() ? "" : ", ") + name;
    return "'" + text + "' refused; expected one of " + expected;
  };
  return {transform, ""};
}

}  // namespace plumb
