#pragma once
// What the sensors say, in SI units, stamped on the flight clock at the middle of the measurement.

#include <array>
#include <cstddef>
#include <cstdint>

#include "fsw/base/time.h"

namespace plumb {

/// One inertial sample in the IMU frame I.
struct ImuSample {
  Time t;
  std::array<double, 3> gyro_rad_s{};  ///< angular rate of I with respect to W, in I
  std::array<double, 3> accel_m_s2{};  ///< specific force in I (at rest: +g along the upward axis)
};

enum class RangeQuality : std::uint8_t {
  kValid = 0,
  kNoReturn,  ///< the device answered but saw no echo
  kWeak,      ///< an echo below the device's signal threshold
};

/// One laser range along the calibrated beam.
struct RangeSample {
  Time t;
  double range_m = 0.0;
  RangeQuality quality = RangeQuality::kNoReturn;
};

enum class DirectionSource : std::uint8_t {
  kSun = 0,       ///< both angles of the direction count
  kMagnetometer,  ///< its azimuth alone counts: iron and currents bend the field's inclination
};
inline constexpr std::size_t kDirectionSources = 2;

/// A direction that a sensor sees and that is known in the world: the sun's, by date and place; the magnetic field's,
/// by declination and inclination. What is known has x east, y north, z up; with it the world's heading is no longer
/// arbitrary. Both need not be of unit length.
struct DirectionSample {
  Time t;
  DirectionSource source = DirectionSource::kSun;
  std::array<double, 3> seen_I{};
  std::array<double, 3> known_W{};
};

/// An 8-bit grey image that somebody else owns. `pixels` points to height rows of stride bytes.
struct ImageView {
  const std::uint8_t* pixels = nullptr;
  std::int32_t width = 0;   ///< px
  std::int32_t height = 0;  ///< px
  std::int32_t stride = 0;  ///< bytes from row to row
};

/// A camera frame: mid-exposure time, a sequence number that counts the sensor's frames, and the pixels.
struct CameraFrame {
  Time t_exposure_mid;
  std::uint32_t sequence = 0;
  ImageView image;
};

}  // namespace plumb
