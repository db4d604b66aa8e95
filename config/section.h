#pragma once
// How the sections of a YAML file are read: step by step, each value within its bounds.

#include <functional>
#include <initializer_list>

#include "config/yaml_file.h"
#include "fsw/base/time.h"

namespace plumb {

/// How a reader takes its steps, which do not depend on each other: the first fault ends the reading, or it is noted
/// and the next step is taken.
using Steps = std::function<void(const std::function<void()>& step)>;
inline const Steps kUntilFirstFault = [](const std::function<void()>& step) { step(); };

// Each throws InputError; where the key is missing, the value is `value`.

/// A number from `min` to `max`.
double number_in(const YamlFile& yaml, const char* key, double value, double min, double max);
int whole_in(const YamlFile& yaml, const char* key, int value, int min, int max);
/// Up to a second.
Duration milliseconds_in(const YamlFile& yaml, const char* key, double value_ms);

/// Each key that is there is a fault, because `why`.
void refuse_keys(const YamlFile& yaml, std::initializer_list<const char*> keys, const char* why, const Steps& steps);

}  // namespace plumb
