#pragma once
// Exposure from the brightness of images, because the sensor has no such control.
//
// The mean of an image is a concave function of the light that it is given: each pixel grows in proportion until it is
// full. So the step that would be right for pixels that never fill, light times target over mean, never goes past the
// target, from either side, whatever the scene. Steps are smaller still where that would disturb the tracking of
// features, and none is made within a band around the target. The exposure therefore moves one way until it is right,
// and then stays.

#include "drivers/ov7251/sensor.h"

namespace plumb::ov7251 {

struct AutoExposureOptions {
  double target = 90.0;    ///< mean of an image, 255 = full; within kMinTarget and kMaxTarget
  double max_gain = 16.0;  ///< kLeastMaxGain to kMaxGain
};

inline constexpr double kMinTarget = 20.0;
inline constexpr double kMaxTarget = 200.0;
/// It begins to adjust when the mean is off by this factor, and goes on until it is off by less than kSettledBand.
inline constexpr double kBand = 1.20;
/// Wider than the coarsest step of exposure and gain, half of 1/16.
inline constexpr double kSettledBand = 1.08;
/// Features are tracked through a change of brightness by this factor.
inline constexpr double kGentleStep = 1.25;
/// Beyond this there is little to be tracked, and what counts is to see again.
inline constexpr double kFarOff = 2.0;
inline constexpr double kMaxStep = 4.0;

class AutoExposure {
 public:
  /// Precondition: options within their limits.
  AutoExposure(const AutoExposureOptions& options, const ExposureLimits& limits);

  /// The exposure to ask for after an image of mean brightness `mean` that was made with `present`; `present` itself
  /// when nothing is to change.
  Exposure update(double mean, const Exposure& present);

  /// The last image was too dark or too bright, and more cannot be done.
  bool at_limit() const { return at_limit_; }
  bool adjusting() const { return adjusting_; }

 private:
  AutoExposureOptions options_;
  ExposureLimits limits_;
  bool adjusting_ = true;  ///< at first until it is settled
  bool at_limit_ = false;
};

}  // namespace plumb::ov7251
