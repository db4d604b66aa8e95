#include "drivers/stim300/datagram.h"

#include <gtest/gtest.h>

#include <string>

#include "test/emulators/stim300/stim300_encoder.h"
#include "test/support/property.h"
#include "test/unit/drivers/stim300/vectors.h"

namespace plumb::stim300 {
namespace {

using test::from_hex;
using test::without_cr_lf;
using Raw = std::array<std::int32_t, 3>;

Datagram decoded(const test::Bytes& bytes) {
  const Result<Datagram> datagram = decode(bytes);
  EXPECT_TRUE(datagram.has_value());
  return datagram ? *datagram : Datagram{};
}

TEST(Stim300Datagram, ChecksumHasTheValuesOfItsCatalogueEntry) {
  const std::string_view nine = "123456789";
  // Nine bytes are padded to twelve; so the published value is tested on the emulator's, and both on each other below.
  EXPECT_EQ(emulator::crc32_mpeg2({nine.begin(), nine.end()}), 0x0376E6E7U);
  EXPECT_EQ(emulator::crc32_mpeg2({0}), 0x4E08BFB4U);
  const test::Bytes padded = {'1', '2', '3', '4', '5', '6', '7', '8', '9', 0, 0, 0};
  EXPECT_EQ(checksum(std::span(padded).first(9)), emulator::crc32_mpeg2(padded));
}

TEST(Stim300Datagram, ReadsWhatARealUnitSent) {
  const Datagram r1 = decoded(without_cr_lf(from_hex(test::kR1)));
  EXPECT_EQ(r1[ClusterId::kGyro], (Cluster{.raw = {-1061, 124, -828}, .status = 0}));
  EXPECT_EQ(r1[ClusterId::kAccel], (Cluster{.raw = {1486, 502, 265812}, .status = 0}));
  EXPECT_EQ(r1[ClusterId::kInclinometer], (Cluster{.raw = {21405, -19785, 4205977}, .status = 0}));
  EXPECT_EQ(r1.counter, 65);
  EXPECT_EQ(r1.latency_us, 507);
  const Datagram r2 = decoded(without_cr_lf(from_hex(test::kR2)));
  EXPECT_EQ(r2[ClusterId::kGyro].raw, (Raw{386, 1139, -2212}));
  EXPECT_EQ(r2[ClusterId::kAccel].raw, (Raw{1970, -1922, 263615}));
  EXPECT_EQ(r2.counter, 81);
  const Datagram r3 = decoded(without_cr_lf(from_hex(test::kR3)));
  EXPECT_EQ(r3[ClusterId::kInclinometer].raw, (Raw{19268, 5741, 4199860}));
  const Datagram r4 = decoded(without_cr_lf(from_hex(test::kR4)));
  EXPECT_EQ(r4[ClusterId::kGyro], (Cluster{.raw = {0x780000, 0x780000, -0x780000}, .status = 0xFF}));
  EXPECT_EQ(r4[ClusterId::kAccel].status, 0xEF);
  EXPECT_EQ(r4[ClusterId::kInclinometer].raw, (Raw{8388607, 5185526, -8388608}));
  EXPECT_EQ(decoded(without_cr_lf(from_hex(test::kR5)))[ClusterId::kGyro].status, kStatusStarting);
  const Datagram r6 = decoded(without_cr_lf(from_hex(test::kR6)));
  EXPECT_EQ(r6[ClusterId::kGyro].status, 0);
  EXPECT_EQ(r6.latency_us, 1012);
}

TEST(Stim300Datagram, ReadsEveryCluster) {
  const Datagram a = decoded(from_hex(test::kA));
  EXPECT_EQ(a[ClusterId::kGyro].raw, (Raw{1 << 14, -(1 << 13), 1}));
  EXPECT_EQ(a[ClusterId::kAccel].raw, (Raw{0, -(1 << 19), 1 << 18}));
  const Datagram b = decoded(without_cr_lf(from_hex(test::kB)));
  EXPECT_EQ(b[ClusterId::kGyro].raw, (Raw{1 << 21, -(1 << 21), 524}));
  EXPECT_EQ(b[ClusterId::kAccel], (Cluster{.raw = {1 << 22, -41120, 0x7FFFFF}, .status = kStatusOverload | 0x04}));
  const Datagram c = decoded(from_hex(test::kC));
  EXPECT_EQ(c[ClusterId::kGyro].raw, (Raw{-8388608, 8388607, 0}));
  EXPECT_EQ(c[ClusterId::kGyroTemperature], (Cluster{.raw = {25 * 256, -40 * 256, 128}, .status = 0x40}));
  EXPECT_EQ(c[ClusterId::kAccelTemperature].raw, (Raw{25 * 256, 25 * 256 + 1, -1}));
  EXPECT_EQ(c.latency_us, 1013);
  const Datagram d = decoded(from_hex(test::kD));
  EXPECT_EQ(d[ClusterId::kGyro].raw, (Raw{100, 200, 300}));
  EXPECT_EQ(d[ClusterId::kAccel].raw, (Raw{1000, 2000, 524288}));
  EXPECT_EQ(d[ClusterId::kInclinometer].raw, (Raw{10, 20, 4194304}));
  EXPECT_EQ(d[ClusterId::kGyroTemperature].raw, (Raw{9120, 9152, 9120}));
  EXPECT_EQ(d[ClusterId::kAccelTemperature].raw, (Raw{8985, 8970, 8988}));
  EXPECT_EQ(d[ClusterId::kInclinometerTemperature].raw, (Raw{9109, 9142, 9109}));
  EXPECT_EQ(d[ClusterId::kPps].raw[0], 123456);
  EXPECT_EQ(d.counter, 225);
}

TEST(Stim300Datagram, RefusesWhatIsAltered) {
  EXPECT_EQ(decode(without_cr_lf(from_hex(test::kR7Bad))).status(), Status::kInvalidValue);
  EXPECT_EQ(decode(from_hex(test::kABad)).status(), Status::kInvalidValue);
  EXPECT_EQ(decode(from_hex(test::kE)).status(), Status::kInvalidValue);  // whole, but no normal datagram
  EXPECT_EQ(decode({}).status(), Status::kInvalidValue);
  test::Bytes cut = from_hex(test::kA);
  cut.pop_back();
  EXPECT_EQ(decode(cut).status(), Status::kInvalidValue);
}

TEST(Stim300Datagram, ReadsTheSerialNumber) {
  const Result<SerialNumber> number = decode_serial_number(from_hex(test::kF));
  ASSERT_TRUE(number);
  EXPECT_EQ(std::string(number->begin(), number->end()), "N25582405002002");
  EXPECT_EQ(decode_serial_number(from_hex(test::kE)).status(), Status::kInvalidValue);
}

// Every content of both generations, with numbers from one end to the other, comes back as the emulator encoded it.
TEST(Stim300Datagram, ReadsEveryContentOfTheEmulator) {
  test::for_all(500, [](test::Generator& g) {
    const emulator::Stim300Setup setup = {.accelerometer = g.integer(0, 1) == 1,
                                          .inclinometer = g.integer(0, 1) == 1,
                                          .temperatures = g.integer(0, 1) == 1,
                                          .pps = g.integer(0, 1) == 1,
                                          .aux = g.integer(0, 1) == 1};
    emulator::Stim300Content content;
    const auto counts = [&g](std::int32_t limit) {
      Raw raw{};
      for (std::int32_t& r : raw) r = static_cast<std::int32_t>(g.integer(-limit - 1, limit));
      return raw;
    };
    content.gyro = counts(8388607);
    content.accel = counts(8388607);
    content.inclinometer = counts(8388607);
    content.temperature = counts(32767);
    content.pps = counts(8388607)[0];
    content.gyro_status = static_cast<std::uint8_t>(g.integer(0, 255));
    content.accel_status = static_cast<std::uint8_t>(g.integer(0, 255));
    content.counter = static_cast<std::uint8_t>(g.integer(0, 255));
    content.latency_us = static_cast<std::uint16_t>(g.integer(0, 65535));
    const test::Bytes bytes = emulator::encode_normal(setup, content);
    ASSERT_EQ(bytes.size(), layout_of(bytes[0]).size);
    const Datagram datagram = decoded(bytes);
    EXPECT_EQ(datagram[ClusterId::kGyro], (Cluster{.raw = content.gyro, .status = content.gyro_status}));
    EXPECT_EQ(datagram.layout.has(ClusterId::kAccel), setup.accelerometer);
    if (setup.accelerometer) {
      EXPECT_EQ(datagram[ClusterId::kAccel].raw, content.accel);
    }
    EXPECT_EQ(datagram.layout.has(ClusterId::kInclinometer), setup.inclinometer);
    if (setup.inclinometer) {
      EXPECT_EQ(datagram[ClusterId::kInclinometer].raw, content.inclinometer);
    }
    EXPECT_EQ(datagram.layout.has(ClusterId::kGyroTemperature), setup.temperatures);
    if (setup.temperatures) {
      EXPECT_EQ(datagram[ClusterId::kGyroTemperature].raw, content.temperature);
    }
    EXPECT_EQ(datagram.layout.has(ClusterId::kAccelTemperature), setup.temperatures && setup.accelerometer);
    EXPECT_EQ(datagram.layout.has(ClusterId::kInclinometerTemperature), setup.temperatures && setup.inclinometer);
    EXPECT_EQ(datagram.layout.has(ClusterId::kPps), setup.pps);
    if (setup.pps) {
      EXPECT_EQ(datagram[ClusterId::kPps].raw[0], content.pps);
    }
    EXPECT_EQ(datagram.counter, content.counter);
    EXPECT_EQ(datagram.latency_us, content.latency_us);
  });
}

// Table 5-21, and the identifiers of older units: what the length alone can not tell.
TEST(Stim300Datagram, KnowsTheLengthsOfTheDataSheet) {
  constexpr std::array<std::uint8_t, 8> kWithoutPps = {18, 28, 28, 38, 25, 42, 42, 59};
  constexpr std::array<std::uint8_t, 8> kOld = {0x98, 0x99, 0x9A, 0x9B, 0x9C, 0xAD, 0xAE, 0xAF};
  constexpr std::array<std::uint8_t, 8> kNew = {0x90, 0x91, 0x92, 0x93, 0x94, 0xA5, 0xA6, 0xA7};
  int known = 0;
  for (unsigned i = 0; i < 256; ++i) known += layout_of(static_cast<std::uint8_t>(i)).kind != Kind::kUnknown ? 1 : 0;
  EXPECT_EQ(known, 8 + 8 + 8 + 1 + 10);
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_EQ(layout_of(kNew[i]).size, kWithoutPps[i]);
    EXPECT_EQ(layout_of(kOld[i]).size, kWithoutPps[i] + 4);
    EXPECT_EQ(layout_of(static_cast<std::uint8_t>(0xF0 + i)).size, kWithoutPps[i] + 4);
  }
  EXPECT_EQ(layout_of(0x97).size, 45);
}

}  // namespace
}  // namespace plumb::stim300
