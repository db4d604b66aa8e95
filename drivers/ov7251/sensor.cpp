#include "drivers/ov7251/sensor.h"

#include <algorithm>
#include <cmath>

#include "fsw/base/assert.h"

namespace plumb::ov7251 {

std::int32_t frame_lines_for(Duration period, Duration line_time) {
  const auto distance = [&](std::int32_t lines) {
    const Duration difference = line_time * lines - period;
    return std::max(difference, -difference);
  };
  return *std::min_element(kFrameLines.begin(), kFrameLines.end(),
                           [&](std::int32_t a, std::int32_t b) { return distance(a) < distance(b); });
}

Exposure expose(double light_s, const ExposureLimits& limits) {
  PLUMB_ASSERT(limits.line_time > Duration() && limits.longest >= limits.line_time);
  const double line_s = limits.line_time.seconds();
  const double most_lines =
      std::floor(static_cast<double>(limits.longest.ns()) / static_cast<double>(limits.line_time.ns()));
  const double most_sixteenths = std::floor(limits.max_gain / kGainStep);
  const double lines = std::clamp(std::floor(light_s / line_s), 1.0, most_lines);
  const double sixteenths =
      std::clamp(std::round(light_s / (lines * line_s) / kGainStep), 1.0 / kGainStep, most_sixteenths);
  return {.time = limits.line_time * static_cast<std::int64_t>(lines), .gain = sixteenths * kGainStep};
}

Duration exposure_for_blur(double blur_px, double focal_px, double rate_rad_s) {
  return Duration::from_seconds(blur_px / (focal_px * rate_rad_s));
}

}  // namespace plumb::ov7251
