#pragma once
// How a STIM300 is set up: what it says in its configuration datagram, and what the flight expects. Source: data sheet
// TS1524 rev.31, tables 5-16 (configuration), 5-8 to 5-12 (codes) and section 7.5.2.2 (scale factors, delays).

#include <array>
#include <cstdint>
#include <span>

#include "fsw/base/fixed_vector.h"
#include "fsw/base/status.h"
#include "fsw/base/time.h"

namespace plumb::stim300 {

/// Internal samples a second, which the counter of a datagram counts.
inline constexpr int kInternalRate_hz = 2000;
inline constexpr Duration kInternalPeriod = Duration::from_us(500);
/// On the line: a start bit, 8 data bits, a stop bit.
inline constexpr int kBitsPerByte = 10;
/// What the unit can be set to, by code: datagrams a second (0: on an external trigger), -3 dB of the low-pass filters.
inline constexpr std::array<int, 6> kRates_hz = {125, 250, 500, 1000, 2000, 0};
inline constexpr std::array<int, 5> kFilters_hz = {16, 33, 66, 131, 262};
/// What the unit takes for g in its own conversions.
inline constexpr double kUnitGravity_m_s2 = 9.80665;

/// What the numbers of the gyros and accelerometers are.
enum class Unit : std::uint8_t {
  kInstant = 0,  ///< angular rate, acceleration: the newest internal sample
  kIncrement,    ///< angle, velocity gained since the last datagram: no motion is aliased
  kAverage,      ///< mean of the internal samples since the last datagram
  kIntegral,     ///< since start-up, wrapping; not used by this driver
};

/// What people call each Unit, of gyros and of accelerometers.
using UnitNames = std::array<const char*, 4>;
inline constexpr UnitNames kGyroUnitNames = {"rate", "increment", "average", "integral"};
inline constexpr UnitNames kAccelUnitNames = {"acceleration", "increment", "average", "integral"};

struct Settings {
  int rate_hz = 250;  ///< datagrams a second: 125, 250, 500, 1000 or 2000; 0: on an external trigger
  Unit gyro_unit = Unit::kIncrement;
  bool gyro_delayed = true;  ///< gyros 4 ms later, to match the accelerometers but for 0.1 ms
  Unit accel_unit = Unit::kIncrement;
  int gyro_filter_hz = 262;  ///< -3 dB of the low-pass filter: 16, 33, 66, 131 or 262
  int accel_filter_hz = 262;
  int accel_range_g = 10;       ///< 5, 10, 30 or 80; 0: units with an AUX input do not say
  std::uint32_t baud = 921600;  ///< bit/s; 0: user-defined
  bool accelerometer = true;    ///< the datagrams have it
  bool inclinometer = false;
  bool temperatures = false;
  bool pps = false;  ///< or AUX
  bool cr_lf = false;
};

/// kInvalidValue: no configuration datagram, its checksum is wrong, it has a code that the data sheet does not know, or
/// the axes of a sensor differ or are off.
Result<Settings> decode_configuration(std::span<const std::uint8_t> bytes);

/// One setting that is not as expected: its name, and both values in its unit (1 and 0 for on and off).
struct Difference {
  const char* name = "";
  std::int64_t expected = 0;
  std::int64_t actual = 0;
  const UnitNames* names = nullptr;  ///< of the values, which are Units then; null: they are numbers
};
using Differences = FixedVector<Difference, 10>;

/// What keeps samples of a unit set up as `actual` from being what is `expected`. Further content of the datagrams, CR
/// LF and the speed of the line do not count: they change how a sample is sent, not what it says.
Differences differences(const Settings& expected, const Settings& actual);

/// Whether this driver can make samples of it: every setting is one that the unit has, of gyros and accelerometers at a
/// fixed rate, not integrated, and a datagram is sent before the next is due (else the unit silently drops every
/// other).
bool is_usable(const Settings& settings);

/// Bytes of a normal datagram on the line, with CR LF if it is on.
std::size_t datagram_bytes(const Settings& settings);

/// rad/s per count; m/s^2 per count. Precondition: is_usable().
double gyro_scale_rad_s(const Settings& settings);
double accel_scale_m_s2(const Settings& settings);

/// From the motion to the newest internal sample in a datagram: the group delay of the filter, and for increments and
/// averages the time from the middle of the internal samples that they are made of. Precondition: is_usable().
Duration gyro_delay(const Settings& settings);
Duration accel_delay(const Settings& settings);

}  // namespace plumb::stim300
