#pragma once
// The OmniVision OV7251 as Linux's driver runs it: its modes, and the steps of exposure and gain.
// Source: Linux, drivers/media/i2c/ov7251.c (link at 240 MHz: 48 million pixels a second, 928 pixel times a line).

#include <array>
#include <cstdint>

#include "fsw/base/time.h"
#include "hal/include/camera_port.h"

namespace plumb::ov7251 {

inline constexpr std::int32_t kWidth = 640;   ///< px
inline constexpr std::int32_t kHeight = 480;  ///< px
/// Of a row, to the nearest ns; the whole image moves by 0.2 us for it. Other link frequencies have another.
inline constexpr Duration kLineTime = Duration::from_ns(19'333);
/// Rows of each mode, blanking included: 30.0, 60.1 and 90.4 frames a second.
inline constexpr std::array<std::int32_t, 3> kFrameLines = {1724, 860, 572};
/// Rows of a frame during which no pixel can be exposed.
inline constexpr std::int32_t kUnexposedLines = 20;
inline constexpr double kGainStep = 1.0 / 16.0;
inline constexpr double kMaxGain = 1023 * kGainStep;
/// With less there is no exposure between those of one line and of two.
inline constexpr double kLeastMaxGain = 2.0;

/// The mode whose period is nearest.
std::int32_t frame_lines_for(Duration period, Duration line_time);

/// What the auto-exposure may ask for.
struct ExposureLimits {
  Duration line_time = kLineTime;
  Duration longest;            ///< of the mode, or what motion blur allows
  double max_gain = kMaxGain;  ///< kLeastMaxGain to kMaxGain
};

/// An exposure as the sensor can do it: whole lines, one at least, and sixteenths of gain. `light` is exposure time
/// times gain, in seconds. Time comes before gain, which adds noise.
Exposure expose(double light_s, const ExposureLimits& limits);

/// Exposure time times gain, in seconds: what the brightness of an image is proportional to.
constexpr double light_s(const Exposure& exposure) { return exposure.time.seconds() * exposure.gain; }

/// The longest exposure during which no point of the image moves by more than `blur_px`, when the camera turns at
/// `rate_rad_s`. The focal length is that of the middle of the image, where it is longest.
Duration exposure_for_blur(double blur_px, double focal_px, double rate_rad_s);

}  // namespace plumb::ov7251
