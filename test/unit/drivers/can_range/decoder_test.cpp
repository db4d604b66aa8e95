#include "drivers/can_range/decoder.h"

#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "test/emulators/can_range/can_range_encoder.h"
#include "test/support/property.h"
#include "test/unit/drivers/can_range/vectors.h"

namespace plumb::can_range {
namespace {

std::vector<Reading> feed(Decoder& decoder, const std::vector<ReceivedCanFrame>& frames) {
  std::vector<Reading> readings;
  for (const ReceivedCanFrame& frame : frames) {
    const Result<Reading> reading = decoder.decode(frame);
    if (reading) readings.push_back(*reading);
  }
  return readings;
}

std::vector<ReceivedCanFrame> at(Time t, const std::vector<CanFrame>& frames) {
  std::vector<ReceivedCanFrame> received;
  for (const CanFrame& frame : frames) received.push_back({t, frame});
  return received;
}

TEST(CanRangeDecoder, DronecanReadings) {
  Decoder decoder({.latency = Duration::from_us(500)});
  const Time t = Time::from_ns(10'000'000);
  const auto valid = feed(decoder, test::frames_of(test::kValid, t));
  ASSERT_EQ(valid.size(), 1U);
  EXPECT_EQ(valid[0].sample.quality, RangeQuality::kValid);
  EXPECT_EQ(valid[0].sample.range_m, 12.5);
  EXPECT_EQ(valid[0].node_id, 42);
  // An extended frame of 8 bytes has 131 bits at 1 Mbit/s.
  EXPECT_EQ(valid[0].sample.t, t - Duration::from_us(131) - Duration::from_us(500));
  for (const auto& words : {test::kTooFar, test::kTooClose}) {
    const auto none = feed(decoder, test::frames_of(std::vector<const char*>{words[0], words[1], words[2]}));
    ASSERT_EQ(none.size(), 1U);
    EXPECT_EQ(none[0].sample.quality, RangeQuality::kNoReturn);
    EXPECT_EQ(none[0].sample.range_m, 0.0);
  }
  EXPECT_EQ(decoder.counters().ranges, 1U);
  EXPECT_EQ(decoder.counters().no_returns, 2U);
}

TEST(CanRangeDecoder, SensorsAreToldApart) {
  test::for_all(100, [](test::Generator& g) {
    const int node = static_cast<int>(g.integer(1, 3));
    const int sensor = static_cast<int>(g.integer(0, 2));
    Decoder decoder({.node_id = g.integer(0, 1) != 0 ? node : kAny, .sensor_id = sensor});
    const CanFilter filter = decoder.filter();
    unsigned accepted = 0;
    for (unsigned i = 0; i < 60; ++i) {
      const unsigned from = static_cast<unsigned>(g.integer(1, 3));
      const unsigned id = static_cast<unsigned>(g.integer(0, 2));
      const auto frames = test::measurement_frames({.node_id = from, .sensor_id = id}, 2.0, 1, i);
      const bool passes = (frames[0].id & filter.mask) == (filter.id & filter.mask);
      for (const Reading& reading : feed(decoder, at(Time::from_ns(i * 40'000'000L), frames))) {
        ASSERT_EQ(reading.node_id, from);
        ASSERT_EQ(reading.sensor_id, sensor);
        ASSERT_TRUE(passes) << "the filter would have kept it away";
        ++accepted;
      }
    }
    ASSERT_EQ(accepted, decoder.counters().ranges);
    ASSERT_EQ(accepted + decoder.counters().other_sensors, 60U);
  });
}

TEST(CanRangeDecoder, ARangeThatIsNoPositiveNumberIsMalformed) {
  Decoder decoder({});
  EXPECT_TRUE(feed(decoder, at(Time::from_ns(0), test::measurement_frames({}, 0.0, 1, 0))).empty());
  EXPECT_EQ(decoder.counters().malformed, 1U);
  EXPECT_EQ(decoder.counters().ranges, 0U);
}

// Only these say whether there was a return: 1 valid, 2 too close, 3 too far.
TEST(CanRangeDecoder, AReadingOfNoKnownTypeIsMalformed) {
  Decoder decoder({});
  std::uint64_t malformed = 0;
  for (unsigned type = 0; type < 8; ++type) {
    const bool known = type >= 1 && type <= 3;
    const auto readings =
        feed(decoder, at(Time::from_ns(type * 40'000'000L), test::measurement_frames({}, 2.0, type, type)));
    EXPECT_EQ(readings.size(), known ? 1U : 0U) << type;
    if (!known) ++malformed;
    EXPECT_EQ(decoder.counters().malformed, malformed) << type;
    if (!known) {
      EXPECT_EQ(decoder.counters().malformed.value, 256 + type);
    }
  }
  EXPECT_EQ(decoder.counters().ranges, 1U);
  EXPECT_EQ(decoder.counters().no_returns, 2U);
}

TEST(CanRangeDecoder, NativeFramesOfTheReference) {
  Decoder decoder({.protocol = Protocol::kBenewake});
  const Time t = Time::from_ns(10'000'000);
  for (const char* word : {"003#D204F4010000", "003#D204F401E8030000"}) {
    const auto readings = feed(decoder, test::frames_of(std::array{word}, t));
    ASSERT_EQ(readings.size(), 1U);
    EXPECT_DOUBLE_EQ(readings[0].sample.range_m, 12.34);
    EXPECT_EQ(readings[0].sample.quality, RangeQuality::kValid);
    EXPECT_EQ(readings[0].node_id, 0);
  }
}

TEST(CanRangeDecoder, NativeFramesOverTheWholeReach) {
  test::for_all(2000, [](test::Generator& g) {
    Decoder decoder({.protocol = Protocol::kBenewake, .bus_bit_s = 250'000, .benewake_min_strength = 100});
    const auto distance_cm = static_cast<unsigned>(g.integer(0, 20'000));
    const auto strength = static_cast<unsigned>(g.integer(0, 65'535));
    const CanFrame frame = g.integer(0, 1) != 0 ? test::benewake_frame(distance_cm, strength)
                                                : test::benewake_frame(distance_cm, strength, 1000);
    const Time t = Time::from_ns(10'000'000);
    const auto readings = feed(decoder, {{t, frame}});
    ASSERT_EQ(readings.size(), 1U);
    const RangeSample& sample = readings[0].sample;
    ASSERT_EQ(t - sample.t, Duration::from_us((47 + 8 * frame.size) * 4));
    if (distance_cm == 0 || distance_cm >= 18'000) {
      ASSERT_EQ(sample.quality, RangeQuality::kNoReturn);
    } else {
      ASSERT_NEAR(sample.range_m * 100.0, distance_cm, 1e-9);
      ASSERT_EQ(sample.quality, strength >= 100 ? RangeQuality::kValid : RangeQuality::kWeak);
    }
  });
}

TEST(CanRangeDecoder, NativeFramesOfAnotherSizeAreMalformed) {
  Decoder decoder({.protocol = Protocol::kBenewake});
  for (const std::uint8_t size : std::array<std::uint8_t, 6>{0, 1, 3, 4, 5, 7}) {
    CanFrame frame = test::benewake_frame(1234, 500);
    frame.size = size;
    EXPECT_EQ(decoder.decode({Time::from_ns(0), frame}).status(), Status::kRejected);
    EXPECT_EQ(decoder.counters().malformed.value, size);
  }
  EXPECT_EQ(decoder.counters().malformed, 6U);
  CanFrame other = test::benewake_frame(1234, 500);
  other.id = 0x004;
  EXPECT_EQ(decoder.decode({Time::from_ns(0), other}).status(), Status::kNotReady);
  EXPECT_EQ(decoder.counters().malformed, 6U);
}

TEST(CanRangeDecoderDeathTest, OptionsOutOfLimitsAreABug) {
  EXPECT_DEATH(Decoder({.bus_bit_s = 0}), "");
  EXPECT_DEATH(Decoder({.node_id = 0}), "");
  EXPECT_DEATH(Decoder({.sensor_id = 256}), "");
  EXPECT_DEATH(Decoder({.benewake_id = 0x800}), "");
}

}  // namespace
}  // namespace plumb::can_range
