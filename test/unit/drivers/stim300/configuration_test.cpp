#include "drivers/stim300/configuration.h"

#include <gtest/gtest.h>

#include <array>

#include "test/emulators/stim300/stim300_encoder.h"
#include "test/support/property.h"
#include "test/unit/drivers/stim300/session.h"
#include "test/unit/drivers/stim300/vectors.h"

namespace plumb::stim300 {
namespace {

using emulator::Stim300Setup;
using test::from_hex;

Settings decoded(const test::Bytes& bytes) {
  const Result<Settings> settings = decode_configuration(bytes);
  EXPECT_TRUE(settings.has_value());
  return settings ? *settings : Settings{};
}

TEST(Stim300Configuration, ReadsTheReferenceDatagram) {
  const Settings s = decoded(from_hex(test::kE));
  EXPECT_EQ(s.rate_hz, 250);
  EXPECT_EQ(s.gyro_unit, Unit::kInstant);
  EXPECT_TRUE(s.gyro_delayed);
  EXPECT_EQ(s.accel_unit, Unit::kInstant);
  EXPECT_EQ(s.gyro_filter_hz, 262);
  EXPECT_EQ(s.accel_filter_hz, 262);
  EXPECT_EQ(s.accel_range_g, 10);
  EXPECT_EQ(s.baud, 921600U);
  EXPECT_TRUE(s.accelerometer);
  EXPECT_FALSE(s.inclinometer || s.temperatures || s.pps || s.cr_lf);
  EXPECT_EQ(datagram_bytes(s), 28U);
  EXPECT_TRUE(is_usable(s));
}

TEST(Stim300Configuration, RefusesWhatItCanNotBe) {
  // One byte altered, and the checksum mended.
  const auto with = [](std::size_t at, std::uint8_t value) {
    test::Bytes body = from_hex(test::kE);
    body.resize(body.size() - 4);
    body[at] = value;
    return decode_configuration(emulator::with_checksum(body, false)).status();
  };
  EXPECT_EQ(with(3, 0x22), Status::kOk);
  EXPECT_EQ(with(3, 0xE2), Status::kInvalidValue);   // rate code 7
  EXPECT_EQ(with(4, 0x51), Status::kInvalidValue);   // bit rate code 5
  EXPECT_EQ(with(5, 0x74), Status::kInvalidValue);   // gyro unit 4
  EXPECT_EQ(with(5, 0x38), Status::kInvalidValue);   // gyro X off
  EXPECT_EQ(with(6, 0x43), Status::kInvalidValue);   // filters of X and Y differ
  EXPECT_EQ(with(6, 0x55), Status::kInvalidValue);   // filter code 5
  EXPECT_EQ(with(8, 0x75), Status::kInvalidValue);   // accelerometer unit 5
  EXPECT_EQ(with(17, 0x03), Status::kInvalidValue);  // ranges of X and Y differ
  EXPECT_EQ(with(17, 0x11), Status::kInvalidValue);  // range code 1
  test::Bytes flipped = from_hex(test::kE);
  flipped[3] ^= 1U;
  EXPECT_EQ(decode_configuration(flipped).status(), Status::kInvalidValue);
  EXPECT_EQ(decode_configuration(from_hex(test::kF)).status(), Status::kInvalidValue);
  EXPECT_EQ(decode_configuration({}).status(), Status::kInvalidValue);
}

TEST(Stim300Configuration, AnOlderUnitDoesNotTellItsRange) {
  EXPECT_EQ(decoded(emulator::encode_configuration({.aux = true, .accel_range_g = 30})).accel_range_g, 0);
  Settings expected;
  Settings actual = expected;
  actual.accel_range_g = 0;
  EXPECT_TRUE(differences(expected, actual).empty());
}

// Whatever an emulated unit is set up to is read back from its datagram.
TEST(Stim300Configuration, ReadsEverySetupOfTheEmulator) {
  constexpr std::array<int, 5> kFilters = {16, 33, 66, 131, 262};
  constexpr int kUnits = 4;
  constexpr std::array<std::uint32_t, 5> kBauds = {374400, 460800, 921600, 1843200, 3000000};
  test::for_all(500, [&](test::Generator& g) {
    Stim300Setup setup = test::any_setup(g, kUnits);
    setup.accelerometer = g.integer(0, 1) == 1;
    setup.baud = kBauds[static_cast<std::size_t>(g.integer(0, 4))];
    test::Bytes bytes = emulator::encode_configuration(setup);
    if (setup.cr_lf) bytes = test::without_cr_lf(bytes);
    const Settings s = decoded(bytes);
    EXPECT_EQ(s.rate_hz, setup.rate_hz());
    EXPECT_EQ(static_cast<int>(s.gyro_unit) + (s.gyro_delayed ? 8 : 0), setup.gyro_unit);
    EXPECT_EQ(static_cast<int>(s.accel_unit), setup.accel_unit);
    EXPECT_EQ(s.gyro_filter_hz, kFilters[static_cast<std::size_t>(setup.gyro_filter)]);
    EXPECT_EQ(s.accel_filter_hz, kFilters[static_cast<std::size_t>(setup.accel_filter)]);
    EXPECT_EQ(s.accel_range_g, setup.accel_range_g);
    EXPECT_EQ(s.baud, setup.baud == 3000000 ? 0 : setup.baud);
    EXPECT_EQ(s.accelerometer, setup.accelerometer);
    EXPECT_EQ(s.inclinometer, setup.inclinometer);
    EXPECT_EQ(s.temperatures, setup.temperatures);
    EXPECT_EQ(s.pps, setup.pps);
    EXPECT_EQ(s.cr_lf, setup.cr_lf);
    EXPECT_EQ(datagram_bytes(s), emulator::encode_normal(setup, {}).size());
  });
}

TEST(Stim300Configuration, NamesEveryDifference) {
  const Settings expected;
  EXPECT_TRUE(differences(expected, expected).empty());
  Settings other_line = expected;  // does not change what a sample says
  other_line.baud = 460800;
  other_line.cr_lf = other_line.temperatures = other_line.inclinometer = other_line.pps = true;
  EXPECT_TRUE(differences(expected, other_line).empty());
  const Settings other = {.rate_hz = 500,
                          .gyro_unit = Unit::kInstant,
                          .gyro_delayed = false,
                          .accel_unit = Unit::kAverage,
                          .gyro_filter_hz = 66,
                          .accel_filter_hz = 131,
                          .accel_range_g = 30,
                          .accelerometer = false};
  const Differences found = differences(expected, other);
  ASSERT_EQ(found.size(), 8U);
  EXPECT_STREQ(found[0].name, "datagrams a second");
  EXPECT_EQ(found[0].expected, 250);
  EXPECT_EQ(found[0].actual, 500);
}

TEST(Stim300Configuration, IsUsableWhenTheLineIsFastEnough) {
  const auto usable = [](int rate_hz, std::uint32_t baud, bool everything) {
    return is_usable(
        {.rate_hz = rate_hz, .baud = baud, .inclinometer = everything, .temperatures = everything, .pps = everything});
  };
  // The table of section 5.4: 28 bytes, then 63.
  EXPECT_TRUE(usable(1000, 374400, false));
  EXPECT_FALSE(usable(2000, 460800, false));
  EXPECT_TRUE(usable(2000, 921600, false));
  EXPECT_TRUE(usable(500, 374400, true));
  EXPECT_FALSE(usable(1000, 460800, true));
  EXPECT_TRUE(usable(1000, 921600, true));
  EXPECT_FALSE(usable(2000, 921600, true));
  EXPECT_TRUE(usable(2000, 1843200, true));
  EXPECT_FALSE(is_usable({.rate_hz = 0}));
  EXPECT_FALSE(is_usable({.rate_hz = 300}));
  EXPECT_FALSE(is_usable({.gyro_unit = Unit::kIntegral}));
  EXPECT_FALSE(is_usable({.accel_unit = Unit::kIntegral}));
  EXPECT_FALSE(is_usable({.gyro_filter_hz = 100}));
  EXPECT_FALSE(is_usable({.accel_range_g = 20}));
  EXPECT_FALSE(is_usable({.accelerometer = false}));
}

TEST(Stim300Configuration, ScalesAndDelaysAreThoseOfTheDataSheet) {
  constexpr double kDegree = 0.017453292519943295;
  const Settings increments;
  EXPECT_DOUBLE_EQ(gyro_scale_rad_s(increments), kDegree / 2097152.0 * 250.0);
  EXPECT_DOUBLE_EQ(accel_scale_m_s2(increments), 250.0 / 4194304.0);
  const Settings instants = {.gyro_unit = Unit::kInstant, .gyro_delayed = false, .accel_unit = Unit::kAverage};
  EXPECT_DOUBLE_EQ(gyro_scale_rad_s(instants), kDegree / 16384.0);
  EXPECT_DOUBLE_EQ(accel_scale_m_s2(instants), 9.80665 / 524288.0);
  // At rest a real 30 g part told 265812 counts on Z.
  EXPECT_NEAR(265812 * accel_scale_m_s2({.accel_unit = Unit::kInstant, .accel_range_g = 30}) / 9.80665, 1.01399231,
              1e-8);
  EXPECT_EQ(gyro_delay(instants), Duration::from_us(2200));
  EXPECT_EQ(accel_delay(instants), Duration::from_us(6300 + 1750));
  EXPECT_EQ(gyro_delay(increments), Duration::from_us(6200 + 1750));
  EXPECT_EQ(accel_delay({.rate_hz = 2000, .accel_range_g = 30}), Duration::from_us(6200));
  EXPECT_EQ(accel_delay({.rate_hz = 2000, .accel_filter_hz = 16, .accel_range_g = 80}), Duration::from_us(28600));
  EXPECT_EQ(gyro_delay({.rate_hz = 2000, .gyro_delayed = false, .gyro_filter_hz = 33}), Duration::from_us(12700));
}

}  // namespace
}  // namespace plumb::stim300
