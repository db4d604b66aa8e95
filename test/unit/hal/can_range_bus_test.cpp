// The CAN range driver on a real socket, with a node played by the public Python package on the other side.

#include <gtest/gtest.h>

#include <cstdio>
#include <string>
#include <vector>

#include "drivers/can_range/node_status.h"
#include "drivers/can_range/receiver.h"
#include "hal/linux/can_socket.h"
#include "hal/linux/monotonic_clock.h"
#include "test/emulators/can_range/can_range_encoder.h"
#include "test/emulators/can_range/can_range_on_bus.h"
#include "test/unit/hal/kernel_part.h"

namespace plumb::can_range {
namespace {

TEST(KernelCanRange, HearsAndIsHeardByThePublicPackage) {
  PLUMB_NEEDS_KERNEL("SocketCAN (modules can-raw and vcan)");
  std::string error;
  const auto can = LinuxCanSocket::open("vcan0", error);
  ASSERT_NE(can, nullptr) << error;
  Receiver receiver(*can, {.node_id = 42, .sensor_id = 0});
  ASSERT_EQ(receiver.start(), Status::kOk);
  std::FILE* node =
      popen(PLUMB_PYTHON " " PLUMB_SOURCE_DIR "/test/emulators/can_range/can_range_node.py on vcan0 2>&1", "r");
  ASSERT_NE(node, nullptr);

  NodeStatusBroadcast status({.node_id = 11}, clock_now());
  std::vector<Reading> readings;
  const Time give_up = clock_now() + Duration::from_ms(60'000);  // Python takes its time to start
  Time quiet_since = clock_now();
  while (clock_now() < give_up && (readings.empty() || clock_now() - quiet_since < Duration::from_ms(1500))) {
    const Result<CanFrame> due = status.next(clock_now(), NodeHealth::kWarning, NodeMode::kMaintenance);
    if (due) {
      EXPECT_EQ(can->send(*due), Status::kOk);
    }
    const Result<Reading> reading = receiver.poll(Duration::from_ms(20));
    if (!reading) continue;
    readings.push_back(*reading);
    quiet_since = clock_now();
  }
  std::string heard;
  char buffer[256];
  while (std::fgets(buffer, sizeof buffer, node) != nullptr) heard += buffer;
  EXPECT_EQ(pclose(node), 0) << heard;

  EXPECT_GE(readings.size(), 40U) << heard;
  for (std::size_t i = 0; i < readings.size(); ++i) {
    const double sent_m = 1.0 + static_cast<double>(i) * 0.0625;  // exact in half precision
    EXPECT_EQ(readings[i].sample.range_m, sent_m);
    EXPECT_EQ(readings[i].sample.quality, RangeQuality::kValid);
    if (i > 0) {
      EXPECT_GT(readings[i].sample.t, readings[i - 1].sample.t);
    }
  }
  EXPECT_EQ(receiver.decoder().transfer_counters().transfers, readings.size());
  EXPECT_EQ(receiver.decoder().transfer_counters().crc_errors, 0U);
  EXPECT_NE(heard.find("status 11 1 2"), std::string::npos) << "health warning, mode maintenance: " << heard;
}

TEST(KernelCanRange, TellsTwoBenewakesOnOneBusApart) {
  PLUMB_NEEDS_KERNEL("SocketCAN (modules can-raw and vcan)");
  std::string error;
  const auto sensors = LinuxCanSocket::open("vcan0", error);
  const auto can = LinuxCanSocket::open("vcan0", error);
  ASSERT_TRUE(sensors && can) << error;
  Receiver receiver(*can, {.protocol = Protocol::kBenewake, .benewake_id = 0x123});
  ASSERT_EQ(receiver.start(), Status::kOk);
  for (const unsigned distance_cm : {1000U, 1100U, 1200U}) {
    for (const std::uint32_t id : {0x003U, 0x123U, 0x124U}) {
      CanFrame frame = test::benewake_frame(distance_cm + id, 500);
      frame.id = id;
      ASSERT_EQ(sensors->send(frame), Status::kOk);
    }
    const Result<Reading> reading = receiver.poll(Duration::from_ms(1000));
    ASSERT_TRUE(reading) << distance_cm;
    EXPECT_DOUBLE_EQ(reading->sample.range_m, (distance_cm + 0x123) * 0.01);
    EXPECT_FALSE(can->receive(Duration())) << "the filter keeps the others away";
  }
}

// The controller takes itself from the bus and is restarted, by what the kernel tells of both. Nobody is heard
// meanwhile.
TEST(KernelCanRange, MeasuresAgainAfterBusOff) {
  PLUMB_NEEDS_KERNEL("SocketCAN (modules can-raw and vcan)");
  test::CanRangeOnBus bus("vcan0", test::CanRangeEmulator::Kind::kDronecan, 12);
  std::string error;
  const auto can = LinuxCanSocket::open("vcan0", error);
  ASSERT_NE(can, nullptr) << error;
  Receiver receiver(*can, {});
  ASSERT_EQ(receiver.start(), Status::kOk);
  constexpr CanFrame kOwn{.id = 1, .is_extended = true, .size = 0, .bytes = {}};
  constexpr Duration kPatience = Duration::from_ms(10'000);
  const auto measures = [&] {
    const Time end = clock_now() + kPatience;
    while (clock_now() < end) {
      if (receiver.poll(Duration::from_ms(20))) return true;
    }
    return false;
  };
  ASSERT_TRUE(measures());
  for (unsigned times = 1; times <= 3; ++times) {
    bus.with_unit([](test::CanRangeEmulator& unit) { unit.faults().silent = true; });
    bus.tell_bus_off(true);
    while (receiver.poll(Duration::from_ms(20))) {
    }
    EXPECT_EQ(can->health().state, CanState::kBusOff);
    EXPECT_EQ(can->send(kOwn), Status::kRejected);
    bus.tell_bus_off(false);
    EXPECT_FALSE(receiver.poll(Duration::from_ms(20)));
    EXPECT_EQ(can->health().state, CanState::kActive) << "before anybody else is heard";
    EXPECT_EQ(can->send(kOwn), Status::kOk);
    bus.with_unit([](test::CanRangeEmulator& unit) { unit.faults().silent = false; });
    EXPECT_TRUE(measures());
    EXPECT_EQ(can->health().bus_offs, times);
    EXPECT_EQ(can->health().restarts, times);
    EXPECT_EQ(receiver.decoder().transfer_counters().crc_errors, 0U);
  }
}

}  // namespace
}  // namespace plumb::can_range
