// libFuzzer on the text of a configuration. Whatever it says, it is refused with a message, or every parameter is in
// its range, the parameters fit each other, and what could be set by itself was set whole or not at all.

#include <cstddef>
#include <cstdint>
#include <string>

#include "config/calibration_reader.h"
#include "config/flight_config.h"
#include "config/input_error.h"
#include "fsw/base/assert.h"

namespace plumb {
namespace {

bool in_range(const Parameters& parameters) {
  for (const ParamRow<Parameters>& row : parameter_table().rows()) {
    const double value = row.get(parameters);
    if (!(value >= row.min && value <= row.max)) return false;
  }
  return true;
}

bool equal(const Parameters& a, const Parameters& b) {
  for (const ParamRow<Parameters>& row : parameter_table().rows()) {
    if (row.get(a) != row.get(b)) return false;
  }
  return true;
}

void check_flight(const std::string& text) {
  std::vector<std::string> faults;
  const FlightSetup setup = read_flight_config("fuzz", text, faults);
  for (const std::string& fault : faults) PLUMB_ASSERT(!fault.empty());
  if (!faults.empty()) return;
  PLUMB_ASSERT(in_range(setup.parameters));
  PLUMB_ASSERT(conflicts_in(setup.parameters).empty());
}

void check_parameters(const std::string& text) {
  Parameters parameters;
  try {
    read_parameters(YamlFile("fuzz", text), parameters);
  } catch (const InputError&) {
    PLUMB_ASSERT(equal(parameters, Parameters{}));
    return;
  }
  PLUMB_ASSERT(in_range(parameters));
}

}  // namespace
}  // namespace plumb

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  plumb::check_flight(text);
  plumb::check_parameters(text);
  return 0;
}
