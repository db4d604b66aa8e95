#include "drivers/can_range/candump.h"

#include <gtest/gtest.h>

#include <string>

#include "test/support/property.h"

namespace plumb::can_range {
namespace {

TEST(Candump, ALine) {
  const Result<ReceivedCanFrame> parsed = parse_candump_line("(1436509052.249713) vcan0 10041A2A#0F8B000000000080\n");
  ASSERT_TRUE(parsed.has_value());
  EXPECT_EQ(parsed->t.ns(), 1'436'509'052'249'713'000);
  EXPECT_EQ(parsed->frame.id, 0x10041A2AU);
  EXPECT_TRUE(parsed->frame.is_extended);
  ASSERT_EQ(parsed->frame.size, 8);
  EXPECT_EQ(parsed->frame.bytes[1], 0x8B);
  EXPECT_EQ(parsed->frame.bytes[7], 0x80);
}

TEST(Candump, AStandardFrameAndOneWithoutData) {
  const Result<ReceivedCanFrame> parsed = parse_candump_line("(0.000001) can0 003#d204F4010000");
  ASSERT_TRUE(parsed.has_value());
  EXPECT_FALSE(parsed->frame.is_extended);
  EXPECT_EQ(parsed->frame.size, 6);
  EXPECT_EQ(parsed->frame.bytes[0], 0xD2);
  const Result<ReceivedCanFrame> empty = parse_candump_line("(0.000001) can0 7FF#");
  ASSERT_TRUE(empty.has_value());
  EXPECT_EQ(empty->frame.size, 0);
}

TEST(Candump, OtherKindsOfFramesAreNone) {
  for (const char* line : {"", "  \n", "(1.000000) can0 123#R", "(1.000000) can0 123##1112233",
                           "(1.000000) can0 20000080#0000000000000000"}) {
    EXPECT_EQ(parse_candump_line(line).status(), Status::kNotReady) << line;
  }
}

TEST(Candump, WhatIsNoSuchLineIsRefused) {
  for (const char* line :
       {"x", "(1.0) can0 123#00", "(1.000000) can0", "(1.000000) can0 123", "(1.000000) can0 1234#00",
        "(1.000000) can0 12G#00", "(1.000000) can0 123#0", "(1.000000) can0 123#0G",
        "(1.000000) can0 123#001122334455667788", "1.000000 can0 123#00", "(a.000000) can0 123#00",
        "(.000000) can0 123#00", "(99999999999.000000) can0 123#00", "(1.000000) can0 F00#00", "(1.000000) can0 #00"}) {
    EXPECT_EQ(parse_candump_line(line).status(), Status::kInvalidValue) << line;
  }
}

TEST(Candump, AnyTextIsSurvived) {
  test::for_all(20'000, [](test::Generator& g) {
    std::string line = "(1436509052.249713) vcan0 10041A2A#0F8B000000000080";
    for (std::int64_t changes = g.integer(1, 4); changes > 0; --changes) {
      const auto at = static_cast<std::size_t>(g.integer(0, static_cast<std::int64_t>(line.size()) - 1));
      if (g.integer(0, 1) == 0) {
        line[at] = static_cast<char>(g.integer(0, 255));
      } else {
        line.erase(at, static_cast<std::size_t>(g.integer(1, 8)));
        if (line.empty()) break;
      }
    }
    const Result<ReceivedCanFrame> parsed = parse_candump_line(line);
    if (parsed) {
      ASSERT_LE(parsed->frame.size, 8) << line;
      ASSERT_LE(parsed->frame.id, kCanExtendedIdMask) << line;
    }
  });
}

}  // namespace
}  // namespace plumb::can_range
