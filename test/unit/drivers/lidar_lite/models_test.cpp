#include "drivers/lidar_lite/models.h"

#include <gtest/gtest.h>

#include <vector>

namespace plumb::lidar_lite {
namespace {

constexpr std::uint8_t kGoodV3 = 0x20;  // health

struct Case {
  Model model;
  Reading reading;
  Verdict verdict;
  double range_m;  // of the sample
};

// 12.34 m is 1234 cm = 0x04D2.
const std::vector<Case> kCases = {
    {Model::kV3, {kGoodV3, {0x04, 0xD2}, 120}, Verdict::kRange, 12.34},
    {Model::kV3, {kGoodV3 | 0x16, {0x04, 0xD2}, 25}, Verdict::kRange, 12.34},  // overflows and a second return: normal
    {Model::kV3, {kGoodV3 | 0x08, {0x04, 0xD2}, 120}, Verdict::kNoReturn, 0.0},
    {Model::kV3, {kGoodV3, {0x04, 0xD2}, 24}, Verdict::kWeak, 12.34},
    {Model::kV3, {0x00, {0x04, 0xD2}, 120}, Verdict::kWeak, 12.34},  // not healthy
    {Model::kV3, {kGoodV3 | 0x40, {0x04, 0xD2}, 120}, Verdict::kWeak, 12.34},
    {Model::kV3, {kGoodV3, {0x00, 0x00}, 120}, Verdict::kNoReturn, 0.0},
    {Model::kV3, {kGoodV3, {0x00, 0x01}, 120}, Verdict::kNoReturn, 0.0},
    {Model::kV3, {kGoodV3, {0x00, 0x04}, 120}, Verdict::kNoReturn, 0.0},
    {Model::kV3, {kGoodV3, {0x00, 0x05}, 120}, Verdict::kRange, 0.05},
    {Model::kV3, {kGoodV3, {0x0F, 0xA0}, 120}, Verdict::kRange, 40.0},
    {Model::kV3, {kGoodV3, {0x0F, 0xA1}, 120}, Verdict::kNoReturn, 0.0},
    {Model::kV3Hp, {0x00, {0x04, 0xD2}, 70}, Verdict::kRange, 12.34},
    {Model::kV3Hp, {0x00, {0x04, 0xD2}, 69}, Verdict::kWeak, 12.34},
    {Model::kV3Hp, {0x08, {0x04, 0xD2}, 120}, Verdict::kNoReturn, 0.0},
    {Model::kV4Led, {0x00, {0xC9, 0x01}, 0}, Verdict::kRange, 4.57},  // 457 cm, low byte first
    {Model::kV4Led, {0x00, {0xE8, 0x03}, 0}, Verdict::kRange, 10.0},
    {Model::kV4Led, {0x00, {0xE9, 0x03}, 0}, Verdict::kNoReturn, 0.0},
    {Model::kV4Led, {0x20, {0xC9, 0x01}, 0}, Verdict::kWeak, 4.57},
    {Model::kV4Led, {0x00, {0x00, 0x00}, 0}, Verdict::kNoReturn, 0.0},
};

TEST(LidarLiteModels, RegistersBecomeRanges) {
  const Time t = Time::from_ns(77);
  for (const Case& c : kCases) {
    SCOPED_TRACE(testing::Message() << "case " << &c - kCases.data());
    const Interpreted interpreted = interpret(table_of(c.model), c.reading);
    ASSERT_EQ(interpreted.verdict, c.verdict);
    const RangeSample sample = to_sample(interpreted, t);
    EXPECT_EQ(sample.t, t);
    EXPECT_DOUBLE_EQ(sample.range_m, c.range_m);
    EXPECT_EQ(sample.quality == RangeQuality::kValid, c.verdict == Verdict::kRange);
    EXPECT_EQ(sample.quality == RangeQuality::kNoReturn, c.verdict == Verdict::kNoReturn);
  }
}

TEST(LidarLiteModels, ATopBitMeansNoReading) {
  EXPECT_EQ(interpret(table_of(Model::kV3), {kGoodV3, {0x84, 0xD2}, 120}).verdict, Verdict::kNoReading);
  EXPECT_EQ(interpret(table_of(Model::kV4Led), {0, {0xD2, 0x84}, 0}).verdict, Verdict::kNoReading);
}

TEST(LidarLiteModelsDeathTest, WhatWasNotReadyIsNoSample) {
  EXPECT_DEATH((void)to_sample({Verdict::kNoReading, 0x8000}, Time::from_ns(0)), "");
}

}  // namespace
}  // namespace plumb::lidar_lite
