#include "drivers/lidar_lite/capture.h"

#include <gtest/gtest.h>

#include <initializer_list>
#include <sstream>
#include <string>

#include "test/support/process.h"

namespace plumb::lidar_lite {
namespace {

Transfer transfer(bool is_read, std::int64_t t_ns, std::initializer_list<std::uint8_t> bytes,
                  bool acknowledged = true) {
  Transfer made{.t_stop = Time::from_ns(t_ns), .is_read = is_read, .acknowledged = acknowledged, .bytes = {}};
  for (const std::uint8_t byte : bytes) (void)made.bytes.push_back(byte);
  return made;
}
Transfer write(std::int64_t t_ns, std::initializer_list<std::uint8_t> bytes) { return transfer(false, t_ns, bytes); }
Transfer read(std::int64_t t_ns, std::initializer_list<std::uint8_t> bytes) { return transfer(true, t_ns, bytes); }

// Feeds all of them; the last result.
Result<Measurement> feed(Capture& capture, std::initializer_list<Transfer> transfers) {
  Result<Measurement> last = Status::kNotReady;
  for (const Transfer& each : transfers) {
    EXPECT_FALSE(last.has_value()) << "a measurement before the last transfer";
    last = capture.decode(each);
  }
  return last;
}

TEST(LidarLiteCapture, OneMeasurement) {
  Capture capture(Model::kV3);
  const Result<Measurement> measured =
      feed(capture,
           {write(1000, {0x00, 0x04}), write(1100, {0x01}), read(1200, {0x21}), write(1900, {0x01}), read(2000, {0x20}),
            write(2100, {0x8F}), read(2200, {0x04, 0xD2}), write(2300, {0x0E}), read(2400, {0x78})});
  ASSERT_TRUE(measured.has_value());
  EXPECT_EQ(measured->t, Time::from_ns(1500)) << "the middle of command and end of busy";
  EXPECT_EQ(measured->interpreted.verdict, Verdict::kRange);
  EXPECT_EQ(measured->interpreted.distance_cm, 1234);
  EXPECT_EQ(measured->strength, 0x78);
}

TEST(LidarLiteCapture, OrderOfStrengthAndDistanceAndTheFlagOfAutoIncrementDoNotMatter) {
  Capture capture(Model::kV3);
  const Result<Measurement> measured =
      feed(capture, {write(0, {0x00, 0x03}), write(1, {0x01}), read(2, {0x20}), write(3, {0x8E}), read(4, {0x78}),
                     write(5, {0x0F}), read(6, {0x04, 0xD2})});
  ASSERT_TRUE(measured.has_value());
  EXPECT_EQ(measured->interpreted.distance_cm, 1234);
}

TEST(LidarLiteCapture, CountsTheCommandsWhoseMeasurementNobodyReads) {
  Capture capture(Model::kV3);
  for (int round = 0; round < 2; ++round) {
    ASSERT_TRUE(feed(capture, {write(0, {0x00, 0x04}), write(1, {0x01}), read(2, {0x20}), write(3, {0x8F}),
                               read(4, {0x04, 0xD2}), write(5, {0x0E}), read(6, {0x78})})
                    .has_value());
  }
  EXPECT_EQ(capture.unread(), 0U);
  const Result<Measurement> none =
      feed(capture, {write(7, {0x00, 0x04}), write(8, {0x01}), read(9, {0x21}), write(10, {0x00, 0x04})});
  EXPECT_FALSE(none.has_value());
  EXPECT_EQ(capture.unread(), 1U);
}

TEST(LidarLiteCapture, NothingWithoutItsParts) {
  for (int left_out = 0; left_out < 7; ++left_out) {
    Capture capture(Model::kV3);
    const Transfer all[] = {write(0, {0x00, 0x04}), write(1, {0x01}), read(2, {0x20}), write(3, {0x8F}),
                            read(4, {0x04, 0xD2}),  write(5, {0x0E}), read(6, {0x78})};
    bool any = false;
    for (int i = 0; i < 7; ++i) {
      if (i != left_out) any = capture.decode(all[i]).has_value() || any;
    }
    EXPECT_FALSE(any) << "without transfer " << left_out;
  }
}

TEST(LidarLiteCapture, AResultReadWhileBusyIsNone) {
  Capture capture(Model::kV3);
  EXPECT_FALSE(feed(capture, {write(0, {0x00, 0x04}), write(1, {0x01}), read(2, {0x21}), write(3, {0x8F}),
                              read(4, {0x04, 0xD2}), write(5, {0x0E}), read(6, {0x78})})
                   .has_value());
}

TEST(LidarLiteCapture, WhatWasNotAcknowledgedIsPassedOver) {
  Capture capture(Model::kV4Led);
  const Result<Measurement> measured =
      feed(capture, {write(0, {0x00, 0x04}), write(1, {0x01}), transfer(true, 2, {0x00}, false), write(3, {0x01}),
                     read(4, {0x00}), write(5, {0x10}), read(6, {0xC9, 0x01})});
  ASSERT_TRUE(measured.has_value());
  EXPECT_EQ(measured->interpreted.distance_cm, 457);
  EXPECT_EQ(measured->t, Time::from_ns(2));
}

TEST(LidarLiteCapture, AResetEndsAMeasurement) {
  Capture capture(Model::kV4Led);
  EXPECT_FALSE(feed(capture, {write(0, {0x00, 0x04}), write(1, {0x00, 0x00}), write(3, {0x01}), read(4, {0x00}),
                              write(5, {0x10}), read(6, {0xC9, 0x01})})
                   .has_value());
}

// The simulator writes transfers by an implementation of its own, in another language.
TEST(LidarLiteCapture, ReadsWhatTheSimulatorRecords) {
  const test::ProgramOutput printed =
      test::output_of("PYTHONPATH=" PLUMB_SOURCE_DIR "/tools " PLUMB_PYTHON " " PLUMB_SOURCE_DIR
                      "/test/emulators/lidar_lite/lidar_lite_capture.py");
  ASSERT_EQ(printed.exit_status, 0);
  Capture capture(Model::kV3);
  std::istringstream lines(printed.text);
  std::string kind;
  std::string last;
  std::int64_t t_ns = 0;
  std::int64_t t_true_ns = 0;
  double range_m = -1.0;
  int measurements = 0;
  int ranges = 0;
  while (lines >> kind >> t_ns >> last) {
    if (kind == "range") {
      t_true_ns = t_ns;
      range_m = std::stod(last);
      ++ranges;
      continue;
    }
    Transfer made{.t_stop = Time::from_ns(t_ns), .is_read = kind == "read", .acknowledged = true, .bytes = {}};
    for (std::size_t i = 0; i < last.size(); i += 2) {
      ASSERT_EQ(made.bytes.push_back(static_cast<std::uint8_t>(std::stoi(last.substr(i, 2), nullptr, 16))),
                Status::kOk);
    }
    const Result<Measurement> measured = capture.decode(made);
    if (!measured) continue;
    ++measurements;
    EXPECT_EQ(measured->t.ns(), t_true_ns);
    const RangeSample sample = to_sample(measured->interpreted, measured->t);
    const bool seen = range_m > 0.0 && range_m <= 40.0;
    EXPECT_EQ(sample.quality, seen ? RangeQuality::kValid : RangeQuality::kNoReturn) << range_m;
    if (seen) {
      EXPECT_NEAR(sample.range_m, range_m, 0.005001);
    }
  }
  EXPECT_EQ(ranges, 100);
  EXPECT_EQ(measurements, ranges);
}

}  // namespace
}  // namespace plumb::lidar_lite
