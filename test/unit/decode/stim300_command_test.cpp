// plumb-decode stim300 as its user meets it: a file in, CSV, counts and exit code out.

#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

#include "test/emulators/stim300/stim300_encoder.h"
#include "test/support/data.h"
#include "test/support/temporary_folder.h"
#include "test/unit/decode/decoded.h"

namespace plumb::test {
namespace {

using emulator::Stim300Content;
using emulator::Stim300Setup;

class DecodeStim300 : public ::testing::Test {
 protected:
  std::string file(const emulator::Bytes& bytes) const {
    return folder_.write("capture.bin", {bytes.begin(), bytes.end()}).string();
  }
  TemporaryFolder folder_;
};

emulator::Bytes joined(const std::vector<emulator::Bytes>& parts) {
  emulator::Bytes all;
  for (const emulator::Bytes& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

TEST_F(DecodeStim300, PrintsMeasurementsInSiUnits) {
  const Stim300Setup setup;
  Stim300Content content;
  content.gyro = {1 << 21, -(1 << 21), 0};   // 1 degree in 4 ms
  content.accel = {1 << 22, 0, -(1 << 22)};  // 1 m/s in 4 ms
  content.counter = 8;
  content.accel_status = 0x14;
  const emulator::Bytes first = emulator::encode_normal(setup, content);
  content.counter = 16;
  const emulator::Bytes second = emulator::encode_normal(setup, content);
  content.counter = 40;
  const emulator::Bytes after_a_gap = emulator::encode_normal(setup, content);
  content.counter = 48;
  const emulator::Bytes last = emulator::encode_normal(setup, content);
  const Decoded result = decode("stim300 " + file(joined({emulator::encode_serial_number(setup),
                                                          emulator::encode_configuration(setup),
                                                          {1, 2, 3},
                                                          first,
                                                          second,
                                                          after_a_gap,
                                                          last})));
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.header,
            "t_s,counter,latency_us,gyro_x_rad_s,gyro_y_rad_s,gyro_z_rad_s,gyro_status,accel_x_m_s2,accel_y_m_s2,"
            "accel_z_m_s2,accel_status");
  ASSERT_EQ(result.rows.size(), 4U);
  EXPECT_EQ(result.rows[0], "0.0000,8,506,4.36332313,-4.36332313,0,0,250,0,-250,20");
  EXPECT_EQ(result.rows[1].substr(0, 13), "0.0040,16,506");
  EXPECT_EQ(result.rows[2].substr(0, 13), "0.0160,40,506");
  EXPECT_EQ(
      result.error,
      "plumb-decode: serial number N25582405002002\n"
      "plumb-decode: 4 measurements at 250 Hz (0 starting), 2 other datagrams, 0 checksum errors, 3 bytes skipped, "
      "1 gaps (2 datagrams missing)\n");
}

// Increments are an angle and a velocity per datagram. A single one does not tell how long it lasted.
TEST_F(DecodeStim300, TakesNoRateOutOfTheAir) {
  Stim300Content content;
  content.gyro = {1 << 21, 0, 0};  // 1 degree
  const std::string one = file(emulator::encode_normal({}, content));
  const std::string setup = " --accel-range 10 --accel-unit increment --gyro-unit ";
  const Decoded unknown = decode("stim300 " + one + setup + "increment");
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_NE(unknown.error.find("give --rate"), std::string::npos) << unknown.error;
  const Decoded told = decode("stim300 " + one + setup + "increment --rate 250");
  ASSERT_EQ(told.rows.size(), 1U) << told.error;
  EXPECT_NE(told.rows[0].find(",4.36332313,"), std::string::npos) << told.rows[0];
  EXPECT_NE(told.error.find("1 measurements at 250 Hz "), std::string::npos) << told.error;
  const Decoded instant = decode("stim300 " + one + " --accel-range 10 --accel-unit acceleration --gyro-unit rate");
  EXPECT_NE(instant.error.find("1 measurements at a rate that is not known "), std::string::npos) << instant.error;
  const std::string configured =
      file(joined({emulator::encode_configuration({}), emulator::encode_normal({}, content)}));
  EXPECT_EQ(decode("stim300 " + configured).rows, told.rows);
  EXPECT_NE(decode("stim300 --rate 500 " + configured).error.find("--rate is not what the unit told"),
            std::string::npos);
}

TEST_F(DecodeStim300, DecodesTheCaptureOfARealUnit) {
  const auto folder = data_folder("stim300");
  if (!folder) GTEST_SKIP() << kNoData;
  const Decoded result = decode("stim300 " + (*folder / "capture_2000hz.bin").string() +
                                " --accel-range 30 --gyro-unit rate --accel-unit acceleration");
  EXPECT_EQ(result.exit_code, 0) << result.error;
  EXPECT_EQ(result.rows.size(), 8392U);
  EXPECT_EQ(result.error,
            "plumb-decode: 8392 measurements at 2000 Hz (562 starting), 0 other datagrams, 0 checksum errors, 28 bytes "
            "skipped, 0 gaps (0 datagrams missing)\n");
}

// That the unit talks is seen without an option, and what is missing is asked for once.
TEST_F(DecodeStim300, CountsWhatItCannotScaleAndAsksForAllThatIsMissing) {
  Stim300Content content;
  std::vector<emulator::Bytes> parts;
  for (const std::uint8_t counter : std::array<std::uint8_t, 4>{8, 16, 40, 48}) {
    content.counter = counter;
    parts.push_back(emulator::encode_normal({}, content));
  }
  const std::string capture = file(joined(parts));
  const std::string counts =
      "\nplumb-decode: 4 measurements at 250 Hz (0 starting), 0 other datagrams, 0 checksum errors, 0 bytes skipped, "
      "1 gaps (2 datagrams missing)\n";
  const auto asked_for = [&](const std::string& given, const std::string& asked) {
    const Decoded result = decode("stim300 " + capture + given);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_EQ(result.header, "");
    EXPECT_EQ(result.error, "plumb-decode: " + capture + ": the capture does not tell how the unit is set up; give " +
                                asked + ", or capture from power-on" + counts);
  };
  asked_for("", "--gyro-unit, --accel-unit, --accel-range");
  asked_for(" --accel-unit increment", "--gyro-unit, --accel-range");
  asked_for(" --accel-range 10 --gyro-unit rate", "--accel-unit");
  const Decoded all = decode("stim300 " + capture + " --accel-range 10 --gyro-unit rate --accel-unit increment");
  EXPECT_EQ(all.exit_code, 0);
  EXPECT_EQ("\n" + all.error, counts);
}

TEST_F(DecodeStim300, SaysWhatIsWrong) {
  const emulator::Bytes normal = emulator::encode_normal({}, {});
  const auto refused = [](const std::string& arguments) {
    const Decoded result = decode(arguments);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_EQ(result.error.substr(0, 14), "plumb-decode: ");
    return result.error;
  };
  EXPECT_NE(refused("stim300 /no/such/file").find("cannot be opened: No such file"), std::string::npos);
  EXPECT_NE(refused("stim300 " + folder_.path().string()).find("cannot be read: Is a directory"), std::string::npos);
  EXPECT_NE(refused("stim300").find("FILE is required"), std::string::npos);
  EXPECT_NE(refused("").find("no kind of device is given; expected one of stim300, lidar-lite, can"),
            std::string::npos);
  EXPECT_NE(refused("foo").find("'foo' is no kind of device; expected one of stim300, lidar-lite, can"),
            std::string::npos);
  const std::string none = refused("stim300 " + file({1, 2, 3}));
  EXPECT_NE(none.find("no measurement; "), std::string::npos);
  EXPECT_NE(none.find("\nplumb-decode: 0 measurements (0 starting), 0 other datagrams, 0 checksum errors, 3 bytes "),
            std::string::npos)
      << none;
  EXPECT_NE(refused("stim300 --gyro-unit foo " + file(normal))
                .find("--gyro-unit: 'foo' refused; expected one of average, increment, rate"),
            std::string::npos);
  EXPECT_NE(refused("stim300 " + file(normal)).find("give --gyro-unit"), std::string::npos);
  EXPECT_NE(refused("stim300 --accel-range 20 " + file(normal)).find("--accel-range"), std::string::npos);
  EXPECT_NE(refused("stim300 --accel-range 30 " + file(joined({emulator::encode_configuration({}), normal})))
                .find("--accel-range is not what the unit told"),
            std::string::npos);
}

TEST_F(DecodeStim300, HasHelp) {
  EXPECT_EQ(decode("--help").exit_code, 0);
  EXPECT_EQ(decode("stim300 --help").exit_code, 0);
}

}  // namespace
}  // namespace plumb::test
