// plumb-decode can: lines of candump with the encoder's frames, back to the ranges they were made of.

#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <string>
#include <vector>

#include "test/emulators/can_range/can_range_encoder.h"
#include "test/support/temporary_folder.h"
#include "test/unit/decode/decoded.h"

namespace plumb::test {
namespace {

class DecodeCan : public ::testing::Test {
 protected:
  void add(const std::vector<CanFrame>& frames) {
    for (const CanFrame& frame : frames) {
      std::array<char, 64> begin{};
      std::snprintf(begin.data(), begin.size(),
                    frame.is_extended ? "(1436509052.%06d) can0 %08X#" : "(1436509052.%06d) can0 %03X#", us_ += 200,
                    frame.id);
      text_ += begin.data();
      for (const std::uint8_t byte : frame.data()) {
        std::array<char, 3> digits{};
        std::snprintf(digits.data(), digits.size(), "%02X", byte);
        text_ += digits.data();
      }
      text_ += "\n";
    }
  }
  std::string file() const { return folder_.write("candump.log", text_).string(); }
  TemporaryFolder folder_;
  std::string text_;
  int us_ = 0;
};

TEST_F(DecodeCan, PrintsRangesOfDronecanNodes) {
  add(measurement_frames({.node_id = 42}, 12.5, 1, 0));
  text_ += "(1436509052.000900) can0 20000004#0004000000000000\nnonsense\n";
  add(measurement_frames({.node_id = 43, .sensor_id = 7}, 0.0, 3, 0));
  const Decoded result = decode("can " + file());
  EXPECT_EQ(result.exit_code, 0) << result.error;
  EXPECT_EQ(result.header, "t_s,node,sensor,range_m,quality");
  ASSERT_EQ(result.rows.size(), 2U);
  EXPECT_EQ(result.rows[0].substr(result.rows[0].find(',')), ",42,0,12.5,valid");
  EXPECT_NE(result.rows[1].find(",43,7,"), std::string::npos);
  EXPECT_NE(result.rows[1].find(",no_return"), std::string::npos);
  EXPECT_EQ(result.error,
            "plumb-decode: 1 ranges, 1 without return, 0 weak; 6 frames, 0 malformed, 0 of other sensors, 0 checksum "
            "errors, 0 transfers broken off, 0 missing, 2 other lines\n");
  const Decoded one = decode("can --node 43 " + file());
  EXPECT_EQ(one.rows.size(), 1U);
  add(measurement_frames({.node_id = 42}, 12.5, 1, 4));
  EXPECT_NE(decode("can " + file()).error.find(" broken off, 3 missing, "), std::string::npos);
}

TEST_F(DecodeCan, PrintsRangesOfABenewake) {
  add({benewake_frame(1234, 500)});
  const Decoded result = decode("can --protocol benewake " + file());
  ASSERT_EQ(result.rows.size(), 1U) << result.error;
  EXPECT_EQ(result.rows[0].substr(result.rows[0].find(',')), ",0,0,12.34,valid");
}

// As the flight software does with the keys far_cm and min_strength.
TEST_F(DecodeCan, TakesALimitAndAStrengthOfABenewake) {
  add({benewake_frame(799, 60), benewake_frame(799, 59), benewake_frame(800, 60)});
  const auto qualities = [this](const std::string& options) {
    std::string all;
    for (const std::string& row : decode("can --protocol benewake " + options + file()).rows) {
      all += row.substr(row.rfind(','));
    }
    return all;
  };
  EXPECT_EQ(qualities(""), ",valid,valid,valid");
  EXPECT_EQ(qualities("--far-cm 800 "), ",valid,valid,no_return");
  EXPECT_EQ(qualities("--min-strength 60 "), ",valid,weak,valid");
  for (const std::string refused : {"--far-cm 1", "--far-cm 65536", "--min-strength -1", "--min-strength 65536"}) {
    EXPECT_EQ(decode("can --protocol benewake " + refused + " " + file()).exit_code, 2) << refused;
  }
}

TEST_F(DecodeCan, SaysWhatIsWrong) {
  add({benewake_frame(1234, 500)});
  const Decoded none = decode("can " + file());
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_NE(none.error.find("no measurement; "), std::string::npos);
  EXPECT_NE(none.error.find("\nplumb-decode: 0 ranges, 0 without return, 0 weak; 1 frames, "), std::string::npos);
  EXPECT_EQ(decode("can --protocol foo " + file()).error,
            "plumb-decode: --protocol: 'foo' refused; expected one of benewake, dronecan\n");
  EXPECT_EQ(decode("can --node 200 " + file()).exit_code, 2);
  EXPECT_EQ(decode("can --help").exit_code, 0);
}

}  // namespace
}  // namespace plumb::test
