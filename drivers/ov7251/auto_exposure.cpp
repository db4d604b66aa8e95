#include "drivers/ov7251/auto_exposure.h"

#include <algorithm>

#include "fsw/base/assert.h"

namespace plumb::ov7251 {
namespace {

bool within(double factor, double band) { return factor < band && factor > 1.0 / band; }

}  // namespace

AutoExposure::AutoExposure(const AutoExposureOptions& options, const ExposureLimits& limits)
    : options_(options), limits_(limits) {
  PLUMB_ASSERT(options.target >= kMinTarget && options.target <= kMaxTarget);
  PLUMB_ASSERT(options.max_gain >= kLeastMaxGain && options.max_gain <= kMaxGain);
  limits_.max_gain = options.max_gain;
}

Exposure AutoExposure::update(double mean, const Exposure& present) {
  constexpr double kDarkest = 0.5;  // a black image says nothing of how much light is missing
  const double factor = options_.target / std::max(mean, kDarkest);
  adjusting_ = !within(factor, adjusting_ ? kSettledBand : kBand);
  at_limit_ = false;
  if (!adjusting_) return present;
  const double limit = within(factor, kFarOff) ? kGentleStep : kMaxStep;
  const Exposure wanted = expose(light_s(present) * std::clamp(factor, 1.0 / limit, limit), limits_);
  at_limit_ = wanted == present;
  return wanted;
}

}  // namespace plumb::ov7251
