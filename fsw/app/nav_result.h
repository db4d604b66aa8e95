#pragma once
// What the nav job hands over for each image.

#include "fsw/telemetry/messages.h"

namespace plumb {

struct NavResult {
  NavState state;
  double reliable_for_s = 0.0;  ///< from the state's time
  FrameReport report;
  EstimatorCounters estimator;
  NavSystemCounters system;
  CalibrationReport calibration;
  double pixel_noise_px = 0.0;
};

}  // namespace plumb
