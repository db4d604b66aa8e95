#include "drivers/can_range/dronecan.h"

#include <gtest/gtest.h>

#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include "test/emulators/can_range/can_range_encoder.h"
#include "test/support/process.h"
#include "test/support/property.h"
#include "test/unit/drivers/can_range/vectors.h"

namespace plumb::can_range {
namespace {

std::vector<ReceivedMeasurement> feed(MeasurementTransfers& transfers, const std::vector<ReceivedCanFrame>& frames) {
  std::vector<ReceivedMeasurement> received;
  for (const ReceivedCanFrame& frame : frames) {
    const Result<ReceivedMeasurement> result = transfers.on_frame(frame);
    if (result) received.push_back(*result);
  }
  return received;
}

TEST(Dronecan, AValidRange) {
  MeasurementTransfers transfers;
  const Time t = Time::from_ns(1'000'000);
  const auto received = feed(transfers, test::frames_of(test::kValid, t));
  ASSERT_EQ(received.size(), 1U);
  EXPECT_EQ(received[0].t_first_frame, t);
  EXPECT_EQ(received[0].node_id, 42);
  const MeasurementMessage& message = received[0].message;
  EXPECT_EQ(message.range_m, 12.5);
  EXPECT_EQ(message.reading_type, ReadingType::kValid);
  EXPECT_EQ(message.sensor_type, 2);
  EXPECT_EQ(message.field_of_view_rad, 0.0078125);
  EXPECT_TRUE(message.has_orientation);
  EXPECT_EQ(message.roll_pitch_yaw, (std::array<std::int8_t, 3>{0, -6, 0}));
  EXPECT_EQ(message.timestamp_us, 0U);
}

TEST(Dronecan, TooFarAndTooClose) {
  MeasurementTransfers transfers;
  const auto far = feed(transfers, test::frames_of(test::kTooFar));
  ASSERT_EQ(far.size(), 1U);
  EXPECT_EQ(far[0].node_id, 125);
  EXPECT_EQ(far[0].message.reading_type, ReadingType::kTooFar);
  EXPECT_EQ(far[0].message.range_m, 40.0);
  EXPECT_EQ(far[0].message.timestamp_us, 1'234'567'890'123U);
  EXPECT_EQ(far[0].message.sensor_id, 3);
  EXPECT_EQ(far[0].message.roll_pitch_yaw[1], 6);
  const auto close = feed(transfers, test::frames_of(test::kTooClose));
  ASSERT_EQ(close.size(), 1U);
  EXPECT_EQ(close[0].message.reading_type, ReadingType::kTooClose);
  EXPECT_EQ(close[0].message.timestamp_us, 17'730'434'519'136U);
  EXPECT_FALSE(close[0].message.has_orientation);
  EXPECT_NEAR(close[0].message.range_m, 0.300048828, 1e-9);
}

TEST(Dronecan, HalfPrecision) {
  EXPECT_EQ(half_to_double(0x0000), 0.0);
  EXPECT_EQ(half_to_double(0x0001), 0x1p-24);
  EXPECT_EQ(half_to_double(0x03FF), 1023 * 0x1p-24);
  EXPECT_EQ(half_to_double(0x0400), 0x1p-14);
  EXPECT_EQ(half_to_double(0x3C00), 1.0);
  EXPECT_EQ(half_to_double(0xC000), -2.0);
  EXPECT_EQ(half_to_double(0x7BFF), 65504.0);
  EXPECT_EQ(half_to_double(0x7C00), HUGE_VAL);
  EXPECT_EQ(half_to_double(0xFC00), -HUGE_VAL);
  EXPECT_TRUE(std::isnan(half_to_double(0x7C01)));
  // Strictly rising over all positive numbers.
  for (unsigned half = 0; half < 0x7C00; ++half) {
    ASSERT_LT(half_to_double(static_cast<std::uint16_t>(half)), half_to_double(static_cast<std::uint16_t>(half + 1)));
  }
}

TEST(Dronecan, AnyBitFlippedIsNoMeasurement) {
  const auto good = test::frames_of(test::kValid);
  for (std::size_t frame = 0; frame < good.size(); ++frame) {
    for (unsigned bit = 0; bit < 8U * good[frame].frame.size; ++bit) {
      auto bad = good;
      bad[frame].frame.bytes[bit / 8] ^= static_cast<std::uint8_t>(1U << bit % 8);
      MeasurementTransfers transfers;
      const auto received = feed(transfers, bad);
      // The transfer id of a transfer is what its frames agree on: no bit of it can be wrong alone.
      EXPECT_TRUE(received.empty()) << "frame " << frame << " bit " << bit;
      EXPECT_EQ(feed(transfers, test::frames_of(test::kTooFar)).size(), 1U) << "another node is not disturbed";
    }
  }
}

TEST(Dronecan, TellsWhatWasWrong) {
  const auto good = test::frames_of(test::kValid);
  const auto head_and = [](const CanFrame& frame, std::int64_t low) { return std::int64_t{frame.id} << 8U | low; };
  MeasurementTransfers transfers;
  const TransferCounters& counters = transfers.counters();
  auto bad = good;
  bad[0].frame.bytes[0] ^= 0x01;  // of the checksum, whose low byte comes first
  feed(transfers, bad);
  EXPECT_EQ(counters.crc_errors.value >> 16U ^ 0x01, counters.crc_errors.value & 0xFFFF);
  feed(transfers, {good[1]});
  EXPECT_EQ(counters.orphans.value, head_and(good[1].frame, good[1].frame.data().back()));
  feed(transfers, {good[0], good[2]});
  EXPECT_EQ(counters.wrong_toggle.value, head_and(good[2].frame, good[2].frame.data().back()));
  auto cut = good[1];
  cut.frame.size = 1;
  feed(transfers, {cut});
  EXPECT_EQ(counters.malformed.value, head_and(cut.frame, 1));
}

TEST(Dronecan, FramesThatAreNoMeasurementAreCounted) {
  MeasurementTransfers transfers;
  const auto frames = test::frames_of(test::kValid);
  auto anonymous = frames[0];
  anonymous.frame.id &= ~0x7FU;
  auto tail_only = frames[0];
  tail_only.frame.size = 1;
  auto short_middle = frames[1];
  short_middle.frame.size = 7;
  short_middle.frame.bytes[6] = 0x20;
  auto overlong = frames[2];  // a third frame that is full: 19 bytes of a message of 15
  overlong.frame.size = 8;
  overlong.frame.bytes[7] = 0x40;
  auto early_end = frames[1];
  early_end.frame.bytes[7] = 0x60;
  feed(transfers, {anonymous, tail_only, frames[0], short_middle});
  EXPECT_EQ(transfers.counters().malformed, 3U);
  feed(transfers, {frames[0], frames[1], overlong});
  EXPECT_EQ(transfers.counters().malformed, 4U);
  feed(transfers, {frames[0], early_end});
  EXPECT_EQ(transfers.counters().malformed, 5U);
  EXPECT_EQ(transfers.counters().transfers, 0U);
}

TEST(Dronecan, FramesOfOtherTypesAreNotLookedAt) {
  MeasurementTransfers transfers;
  auto frames = test::frames_of(test::kValid);
  for (auto& received : frames) received.frame.id ^= 0x100;  // another type
  EXPECT_TRUE(feed(transfers, frames).empty());
  for (auto& received : frames) received.frame.id ^= 0x180;  // a service
  EXPECT_TRUE(feed(transfers, frames).empty());
  for (auto& received : frames) received.frame = {.id = 0x41A, .is_extended = false, .size = 8, .bytes = {}};
  EXPECT_TRUE(feed(transfers, frames).empty());
  EXPECT_EQ(transfers.counters().malformed + transfers.counters().orphans, 0U);
}

TEST(Dronecan, ATransferDoesNotTakeLong) {
  MeasurementTransfers transfers;
  auto frames = test::frames_of(test::kValid);
  frames[2].t = frames[0].t + MeasurementTransfers::kMaxTransfer + Duration::from_ns(1);
  EXPECT_TRUE(feed(transfers, frames).empty());
  EXPECT_EQ(transfers.counters().abandoned, 1U);
}

// One id after the other, modulo 32, of each node for itself; not across a silence.
TEST(Dronecan, MissingTransfersAreCountedByTheirIds) {
  MeasurementTransfers transfers;
  Time t = Time::from_ns(0);
  const auto send = [&](unsigned node, unsigned id, Duration after) {
    t = t + after;
    for (const CanFrame& frame : test::measurement_frames({.node_id = node}, 3.0, 1, id)) {
      static_cast<void>(transfers.on_frame({t, frame}));
    }
    return transfers.counters().missing;
  };
  const Duration period = Duration::from_ms(40);
  EXPECT_EQ(send(42, 29, period), 0U) << "nobody knows what was before the first";
  EXPECT_EQ(send(43, 7, period), 0U);
  EXPECT_EQ(send(42, 30, period), 0U);
  EXPECT_EQ(send(42, 30, period), 0U) << "the same once more";
  EXPECT_EQ(send(43, 10, period), 2U);
  EXPECT_EQ(send(42, 1, period), 4U) << "31 and 0";
  EXPECT_EQ(send(42, 20, MeasurementTransfers::kMaxCounted), 4U);
  EXPECT_EQ(transfers.counters().transfers, 6U);
}

TEST(Dronecan, MoreNodesThanThereIsRoomForTakeTurns) {
  MeasurementTransfers transfers;
  for (unsigned node = 1; node <= 10; ++node) {
    std::vector<ReceivedCanFrame> frames;
    for (const CanFrame& frame : test::measurement_frames({.node_id = node}, 3.0, 1, 0)) {
      frames.push_back({Time::from_ns(node * 1'000'000), frame});
    }
    EXPECT_EQ(feed(transfers, frames).size(), 1U);
  }
  EXPECT_EQ(transfers.counters().nodes_forgotten, 10U - MeasurementTransfers::kMaxNodes);
  EXPECT_EQ(transfers.counters().nodes_forgotten.value, 10 - static_cast<int>(MeasurementTransfers::kMaxNodes));
}

// Two sensors on one bus, their frames in any interleaving, any of them lost or doubled: what is accepted was sent,
// once, by that sensor; and the first transfer of a sensor that arrives whole after a disturbance is accepted.
TEST(Dronecan, NothingWrongIsAcceptedFromADisturbedBus) {
  test::for_all(300, [](test::Generator& g) {
    struct Sent {
      std::vector<CanFrame> frames;
      unsigned node_id = 0;
      double range_m = 0.0;
      bool whole = true;
      bool accepted = false;
    };
    constexpr unsigned kNodes[] = {42, 125};
    const double loss = g.uniform(0.0, 0.5);
    const double doubling = g.uniform(0.0, 0.5);
    MeasurementTransfers transfers;
    Time t = Time::from_ns(0);
    unsigned transfer_id[] = {static_cast<unsigned>(g.integer(0, 31)), static_cast<unsigned>(g.integer(0, 31))};
    for (int round = 0; round < 80; ++round) {
      t = t + Duration::from_ms(40);
      Sent sent[2];
      std::vector<CanFrame> bus[2];
      for (int s = 0; s < 2; ++s) {
        sent[s].node_id = kNodes[s];
        sent[s].range_m = static_cast<double>(g.integer(1, 1023)) / 16.0;  // exact in half precision
        sent[s].frames = test::measurement_frames({.node_id = kNodes[s]}, sent[s].range_m, 1, transfer_id[s]++);
        for (const CanFrame& frame : sent[s].frames) {
          const bool lost = g.uniform(0.0, 1.0) < loss;
          if (lost) sent[s].whole = false;
          for (int copies = lost ? 0 : g.uniform(0.0, 1.0) < doubling ? 2 : 1; copies > 0; --copies)
            bus[s].push_back(frame);
        }
      }
      std::size_t next[2] = {0, 0};
      while (next[0] < bus[0].size() || next[1] < bus[1].size()) {
        int s = static_cast<int>(g.integer(0, 1));
        if (next[s] == bus[s].size()) s = 1 - s;
        t = t + Duration::from_us(131);
        const Result<ReceivedMeasurement> received = transfers.on_frame({t, bus[s][next[s]++]});
        if (!received) continue;
        ASSERT_EQ(received->node_id, sent[s].node_id);
        ASSERT_EQ(received->message.range_m, sent[s].range_m);
        ASSERT_FALSE(sent[s].accepted) << "accepted twice";
        sent[s].accepted = true;
      }
      for (const Sent& each : sent) ASSERT_EQ(each.accepted, each.whole);
    }
    ASSERT_EQ(transfers.counters().crc_errors, 0U) << "frames of different transfers met";
  });
}

TEST(Dronecan, AnyFramesAreSurvived) {
  test::for_all(200, [](test::Generator& g) {
    MeasurementTransfers transfers;
    for (int i = 0; i < 2000; ++i) {
      CanFrame frame{.id = 0x10041A00U | static_cast<unsigned>(g.integer(0, 7)),
                     .is_extended = true,
                     .size = static_cast<std::uint8_t>(g.integer(0, 8)),
                     .bytes = {}};
      for (auto& byte : frame.bytes) byte = static_cast<std::uint8_t>(g.bits());
      (void)transfers.on_frame({Time::from_ns(i * 100'000), frame});
    }
    const auto good = test::frames_of(test::kValid, Time::from_ns(1'000'000'000));
    ASSERT_EQ(feed(transfers, good).size(), 1U);
  });
}

// Frames by the public Python package, without a bus. Over a real one: the test can_range_bus.
TEST(Dronecan, ReadsWhatThePublicPackageEncodes) {
  const test::ProgramOutput printed =
      test::output_of(PLUMB_PYTHON " " PLUMB_SOURCE_DIR "/test/emulators/can_range/can_range_node.py frames");
  ASSERT_EQ(printed.exit_status, 0);
  MeasurementTransfers transfers;
  std::istringstream lines(printed.text);
  std::string line;
  unsigned node_id = 0;
  unsigned sensor_id = 0;
  unsigned reading_type = 0;
  double range_m = 0.0;
  int ranges = 0;
  int received = 0;
  while (std::getline(lines, line)) {
    if (line.starts_with("range ")) {
      ++ranges;
      std::istringstream(line.substr(6)) >> node_id >> sensor_id >> reading_type >> range_m;
      continue;
    }
    const Result<ReceivedCanFrame> frame = parse_candump_line(line);
    ASSERT_TRUE(frame.has_value()) << line;
    const Result<ReceivedMeasurement> measured = transfers.on_frame(*frame);
    if (!measured) continue;
    ++received;
    EXPECT_EQ(measured->node_id, node_id);
    EXPECT_EQ(measured->message.sensor_id, sensor_id);
    EXPECT_EQ(static_cast<unsigned>(measured->message.reading_type), reading_type);
    EXPECT_NEAR(measured->message.range_m, range_m, range_m / 2048.0);
    EXPECT_EQ(measured->message.roll_pitch_yaw[1], -6);
  }
  EXPECT_EQ(ranges, 200);
  EXPECT_EQ(received, ranges);
}

}  // namespace
}  // namespace plumb::can_range
