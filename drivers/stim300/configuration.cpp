#include "drivers/stim300/configuration.h"

#include <array>
#include <numbers>

#include "drivers/stim300/datagram.h"

namespace plumb::stim300 {
namespace {

// Codes of the configuration datagram, by index.
constexpr std::array<std::uint32_t, 4> kBauds = {374400, 460800, 921600, 1843200};
constexpr unsigned kUserBaudCode = 15;

// Section 7.5.2.2: counts are 2^n per g, and for increments 2^n per m/s.
struct AccelRange {
  int range_g;
  std::uint8_t code;
  std::uint8_t bits;
  std::uint8_t increment_bits;
};
constexpr std::array<AccelRange, 4> kAccelRanges = {
    {{10, 0, 19, 22}, {5, 3, 20, 23}, {30, 4, 18, 21}, {80, 6, 16, 19}}};
constexpr unsigned kGyroBits = 14;           // 2^n counts per deg/s
constexpr unsigned kGyroIncrementBits = 21;  // 2^n counts per deg

// Group delays, in the order of kFilters_hz.
constexpr std::array<int, 5> kGyroDelays_us = {24700, 12700, 6700, 3700, 2200};
constexpr int kDelayedGyro_us = 4000;

template <typename Table, typename Value>
constexpr std::size_t index_of(const Table& table, const Value& value) {
  std::size_t i = 0;
  while (i < table.size() && table[i] != value) ++i;
  return i;
}

constexpr std::size_t range_index(int range_g) {
  std::size_t i = 0;
  while (i < kAccelRanges.size() && kAccelRanges[i].range_g != range_g) ++i;
  return i;
}

// The 5 and 10 g accelerometers are 0.1 ms slower than the 30 g ones, and these than the 80 g ones.
constexpr int accel_delay_us(int filter_hz, int range_g) {
  constexpr std::array<int, 5> kSlowest_us = {28800, 16800, 10800, 7800, 6300};
  const int faster_us = range_g == 80 ? 200 : range_g == 30 ? 100 : 0;
  return kSlowest_us[index_of(kFilters_hz, filter_hz)] - faster_us;
}

constexpr double power_of_two(unsigned n) { return static_cast<double>(std::uint64_t{1} << n); }

// Increments and averages are made of the internal samples since the last datagram, this one included; an instant is
// the newest of them. From there to their middle:
Duration to_middle(Unit unit, int rate_hz) {
  const int internal_samples = kInternalRate_hz / rate_hz;
  if (unit == Unit::kInstant) return {};
  return kInternalPeriod / 2 * (internal_samples - 1);
}

// Bits 6 to 4 and 2 to 0 of two bytes hold the filter of X, Y, Z. Returns the table's size when they differ.
std::size_t filter_code(std::uint8_t xy, std::uint8_t z) {
  const unsigned code = xy >> 4U & 7U;
  const bool equal = code == (xy & 7U) && code == (z >> 4U & 7U);
  return equal && code < kFilters_hz.size() ? code : kFilters_hz.size();
}

bool all_axes_active(std::uint8_t byte) { return (byte & 0x70U) == 0x70U; }

// Bytes 3 and 4: rate, content, line.
bool decode_transmission(std::span<const std::uint8_t> bytes, Settings& settings) {
  const std::size_t rate = bytes[3] >> 5U;
  const unsigned baud = bytes[4] >> 4U;
  if (rate >= kRates_hz.size() || (baud >= kBauds.size() && baud != kUserBaudCode)) return false;
  settings.rate_hz = kRates_hz[rate];
  settings.pps = (bytes[3] & 0x10U) != 0;
  settings.temperatures = (bytes[3] & 0x08U) != 0;
  settings.inclinometer = (bytes[3] & 0x04U) != 0;
  settings.accelerometer = (bytes[3] & 0x02U) != 0;
  settings.cr_lf = (bytes[3] & 0x01U) != 0;
  settings.baud = baud == kUserBaudCode ? 0 : kBauds[baud];
  return true;
}

// Bytes 5 to 10: units and filters of gyros and accelerometers.
bool decode_sensors(std::span<const std::uint8_t> bytes, Settings& settings) {
  const unsigned gyro_unit = bytes[5] & 0xFU;
  const unsigned accel_unit = bytes[8] & 0xFU;
  constexpr unsigned kDelayedBit = 8;
  constexpr unsigned kLastAccelUnit = 4;  // 3 and 4 both integrate, in g*s and in m/s
  if ((gyro_unit & ~kDelayedBit) > static_cast<unsigned>(Unit::kIntegral) || accel_unit > kLastAccelUnit) return false;
  settings.gyro_unit = static_cast<Unit>(gyro_unit & ~kDelayedBit);
  settings.gyro_delayed = (gyro_unit & kDelayedBit) != 0;
  settings.accel_unit = accel_unit == kLastAccelUnit ? Unit::kIntegral : static_cast<Unit>(accel_unit);
  const std::size_t gyro_filter = filter_code(bytes[6], bytes[7]);
  const std::size_t accel_filter = filter_code(bytes[9], bytes[10]);
  if (gyro_filter == kFilters_hz.size() || accel_filter == kFilters_hz.size()) return false;
  settings.gyro_filter_hz = kFilters_hz[gyro_filter];
  settings.accel_filter_hz = kFilters_hz[accel_filter];
  return all_axes_active(bytes[5]) && all_axes_active(bytes[8]);
}

// Bytes 17 and 18, where bit 3 of byte 14 says that they have that meaning.
bool decode_accel_range(std::span<const std::uint8_t> bytes, Settings& settings) {
  settings.accel_range_g = 0;
  if ((bytes[14] & 0x08U) == 0) return true;
  const unsigned code = bytes[17] >> 4U;
  if (code != (bytes[17] & 0xFU) || code != bytes[18] >> 4U) return false;
  for (const AccelRange& range : kAccelRanges) {
    if (range.code == code) settings.accel_range_g = range.range_g;
  }
  return settings.accel_range_g != 0;
}

}  // namespace

Result<Settings> decode_configuration(std::span<const std::uint8_t> bytes) {
  if (!is_whole(bytes, Kind::kConfiguration)) return Status::kInvalidValue;
  Settings settings;
  const bool known =
      decode_transmission(bytes, settings) && decode_sensors(bytes, settings) && decode_accel_range(bytes, settings);
  if (!known) return Status::kInvalidValue;
  return settings;
}

Differences differences(const Settings& expected, const Settings& actual) {
  Differences found;
  const auto compare = [&found](const char* name, auto wanted, auto got, const UnitNames* names = nullptr) {
    if (wanted == got) return;
    PLUMB_ASSERT(ok(found.push_back({name, static_cast<std::int64_t>(wanted), static_cast<std::int64_t>(got), names})));
  };
  compare("datagrams a second", expected.rate_hz, actual.rate_hz);
  compare("accelerometer in the datagram", expected.accelerometer, actual.accelerometer);
  compare("gyro unit", expected.gyro_unit, actual.gyro_unit, &kGyroUnitNames);
  compare("gyro delayed", expected.gyro_delayed, actual.gyro_delayed);
  compare("accelerometer unit", expected.accel_unit, actual.accel_unit, &kAccelUnitNames);
  compare("gyro filter in Hz", expected.gyro_filter_hz, actual.gyro_filter_hz);
  compare("accelerometer filter in Hz", expected.accel_filter_hz, actual.accel_filter_hz);
  const bool range_is_told = actual.accel_range_g != 0;
  if (range_is_told) compare("accelerometer range in g", expected.accel_range_g, actual.accel_range_g);
  return found;
}

bool is_usable(const Settings& settings) {
  const bool known = settings.rate_hz > 0 && index_of(kRates_hz, settings.rate_hz) < kRates_hz.size() &&
                     index_of(kFilters_hz, settings.gyro_filter_hz) < kFilters_hz.size() &&
                     index_of(kFilters_hz, settings.accel_filter_hz) < kFilters_hz.size() &&
                     range_index(settings.accel_range_g) < kAccelRanges.size();
  const bool integrated = settings.gyro_unit == Unit::kIntegral || settings.accel_unit == Unit::kIntegral;
  if (!known || integrated || !settings.accelerometer) return false;
  const std::uint64_t bits_per_second =
      datagram_bytes(settings) * kBitsPerByte * static_cast<unsigned>(settings.rate_hz);
  return settings.baud == 0 || bits_per_second <= settings.baud;
}

std::size_t datagram_bytes(const Settings& settings) {
  constexpr std::size_t kInertialBytes = 10;
  constexpr std::size_t kTemperatureBytes = 7;
  constexpr std::size_t kPpsBytes = 4;
  constexpr std::size_t kFixedBytes = 1 + 1 + 2 + kChecksumBytes;
  const std::size_t sensors = 1U + (settings.accelerometer ? 1U : 0U) + (settings.inclinometer ? 1U : 0U);
  return kFixedBytes + sensors * (kInertialBytes + (settings.temperatures ? kTemperatureBytes : 0U)) +
         (settings.pps ? kPpsBytes : 0U) + (settings.cr_lf ? 2U : 0U);
}

double gyro_scale_rad_s(const Settings& settings) {
  constexpr double kRadPerDeg = std::numbers::pi / 180.0;
  if (settings.gyro_unit != Unit::kIncrement) return kRadPerDeg / power_of_two(kGyroBits);
  return kRadPerDeg * settings.rate_hz / power_of_two(kGyroIncrementBits);
}

double accel_scale_m_s2(const Settings& settings) {
  PLUMB_ASSERT(range_index(settings.accel_range_g) < kAccelRanges.size());
  const AccelRange& range = kAccelRanges[range_index(settings.accel_range_g)];
  if (settings.accel_unit != Unit::kIncrement) return kUnitGravity_m_s2 / power_of_two(range.bits);
  return settings.rate_hz / power_of_two(range.increment_bits);
}

Duration gyro_delay(const Settings& settings) {
  const int filter_us = kGyroDelays_us[index_of(kFilters_hz, settings.gyro_filter_hz)];
  return Duration::from_us(filter_us + (settings.gyro_delayed ? kDelayedGyro_us : 0)) +
         to_middle(settings.gyro_unit, settings.rate_hz);
}

Duration accel_delay(const Settings& settings) {
  return Duration::from_us(accel_delay_us(settings.accel_filter_hz, settings.accel_range_g)) +
         to_middle(settings.accel_unit, settings.rate_hz);
}

}  // namespace plumb::stim300
