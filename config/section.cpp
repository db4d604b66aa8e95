#include "config/section.h"

#include <cmath>
#include <sstream>

namespace plumb {

double number_in(const YamlFile& yaml, const char* key, double value, double min, double max) {
  const double found = yaml.optional_number(key).value_or(value);
  if (found >= min && found <= max) return found;
  std::ostringstream expected;
  expected << "expected " << min << " to " << max;
  yaml.fail(key, expected.str());
}

int whole_in(const YamlFile& yaml, const char* key, int value, int min, int max) {
  const double found = number_in(yaml, key, value, min, max);
  if (found != std::floor(found)) yaml.fail(key, "expected a whole number");
  return static_cast<int>(found);
}

Duration milliseconds_in(const YamlFile& yaml, const char* key, double value_ms) {
  return Duration::from_seconds(1e-3 * number_in(yaml, key, value_ms, 0.0, 1000.0));
}

void refuse_keys(const YamlFile& yaml, std::initializer_list<const char*> keys, const char* why, const Steps& steps) {
  for (const char* key : keys) {
    steps([&] {
      if (yaml.has(key)) yaml.fail(key, why);
    });
  }
}

}  // namespace plumb
