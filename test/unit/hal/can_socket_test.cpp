// SocketCAN over a virtual CAN interface: a second socket plays the bus and the controller.

#include "hal/linux/can_socket.h"

#include <gtest/gtest.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <memory>
#include <string>

#include "hal/linux/monotonic_clock.h"
#include "test/unit/hal/kernel_part.h"

namespace plumb {
namespace {

constexpr CanFilter kAnyStandard{.id = 0, .mask = 0, .is_extended = false};
constexpr CanFilter kAnyExtended{.id = 0, .mask = 0, .is_extended = true};
constexpr Duration kLong = Duration::from_ms(1000);

/// The other end of the bus, by plain system calls.
class Bus {
 public:
  Bus() : socket_(socket(PF_CAN, SOCK_RAW, CAN_RAW)) {
    sockaddr_can address{};
    address.can_family = AF_CAN;
    address.can_ifindex = static_cast<int>(if_nametoindex("vcan0"));
    EXPECT_EQ(bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  }
  ~Bus() { close(socket_); }
  void put(canid_t id, std::initializer_list<std::uint8_t> data) const {
    can_frame frame{};
    frame.can_id = id;
    frame.can_dlc = static_cast<__u8>(data.size());
    std::copy(data.begin(), data.end(), frame.data);
    EXPECT_EQ(write(socket_, &frame, sizeof frame), static_cast<ssize_t>(sizeof frame));
  }
  void put_state(std::uint8_t reason) const { put(CAN_ERR_FLAG | CAN_ERR_CRTL, {0, reason, 0, 0, 0, 0, 0, 0}); }
  can_frame take() const {
    can_frame frame{};
    EXPECT_EQ(read(socket_, &frame, sizeof frame), static_cast<ssize_t>(sizeof frame));
    return frame;
  }

 private:
  int socket_;
};

// A kernel that has stamped nothing yet begins to some time after it was asked to.
void wait_for_stamps() { usleep(300'000); }

void shell(const char* command) { ASSERT_EQ(std::system(command), 0) << command; }

std::unique_ptr<LinuxCanSocket> open_vcan(std::initializer_list<CanFilter> filters) {
  std::string error;
  std::unique_ptr<LinuxCanSocket> can = LinuxCanSocket::open("vcan0", error);
  EXPECT_NE(can, nullptr) << error;
  EXPECT_EQ(can->set_filters({filters.begin(), filters.size()}), Status::kOk);
  return can;
}

TEST(CanSocket, SaysWhichInterfaceIsNotThere) {
  std::string error;
  EXPECT_EQ(LinuxCanSocket::open("nonsense7", error), nullptr);
  EXPECT_NE(error.find("nonsense7"), std::string::npos);
}

TEST(KernelCanSocket, ReceivesWithTheTimeOfTheFrame) {
  PLUMB_NEEDS_KERNEL("SocketCAN (modules can-raw and vcan)");
  const auto can = open_vcan({kAnyStandard, kAnyExtended});
  const Bus bus;
  wait_for_stamps();
  const Time before = clock_now();
  bus.put(0x123, {1, 2, 3});
  const Time after = clock_now();
  usleep(50'000);  // waits in the queue: the stamp is the frame's, not the reading's
  bus.put(0x10041A2A | CAN_EFF_FLAG, {});
  const Result<ReceivedCanFrame> first = can->receive(kLong);
  ASSERT_TRUE(first.has_value());
  EXPECT_EQ(first->frame, (CanFrame{.id = 0x123, .is_extended = false, .size = 3, .bytes = {1, 2, 3}}));
  EXPECT_GE(first->t, before - Duration::from_us(200));
  EXPECT_LE(first->t, after + Duration::from_us(200));
  const Result<ReceivedCanFrame> second = can->receive(kLong);
  ASSERT_TRUE(second.has_value());
  EXPECT_EQ(second->frame, (CanFrame{.id = 0x10041A2A, .is_extended = true, .size = 0, .bytes = {}}));
  EXPECT_GE(second->t - first->t, Duration::from_ms(49));
  EXPECT_EQ(can->health().received, 2U);
  EXPECT_EQ(can->health().stamps_mended, 0U);
}

TEST(KernelCanSocket, ASetClockDoesNotMoveStamps) {
  PLUMB_NEEDS_KERNEL("SocketCAN (modules can-raw and vcan)");
  const auto can = open_vcan({kAnyStandard});
  const Bus bus;
  wait_for_stamps();
  bus.put(0x123, {});
  timeval t{};
  gettimeofday(&t, nullptr);
  t.tv_sec += 3600;
  ASSERT_EQ(settimeofday(&t, nullptr), 0);
  const Result<ReceivedCanFrame> received = can->receive(kLong);
  ASSERT_TRUE(received.has_value());
  EXPECT_LE(received->t, clock_now());
  EXPECT_GE(received->t, clock_now() - Duration::from_ms(1000));
  EXPECT_EQ(can->health().stamps_mended, 1U);
  bus.put(0x123, {});
  ASSERT_TRUE(can->receive(kLong).has_value());
  EXPECT_EQ(can->health().stamps_mended, 1U) << "what comes after is right again";
}

TEST(KernelCanSocket, FiltersLetThroughWhatTheySay) {
  PLUMB_NEEDS_KERNEL("SocketCAN (modules can-raw and vcan)");
  const auto can = open_vcan({{.id = 0x41A00, .mask = 0xFFFF80, .is_extended = true}});
  const Bus bus;
  bus.put(0x10041A2A | CAN_EFF_FLAG, {1});
  bus.put(0x10041B2A | CAN_EFF_FLAG, {2});
  bus.put(0x18041A7D | CAN_EFF_FLAG, {3});
  bus.put(0x200, {4});
  bus.put(0x10041A2A | CAN_EFF_FLAG | CAN_RTR_FLAG, {});
  ASSERT_EQ(can->receive(kLong)->frame.bytes[0], 1);
  ASSERT_EQ(can->receive(kLong)->frame.bytes[0], 3);
  EXPECT_EQ(can->receive(Duration()).status(), Status::kNotReady);
  ASSERT_EQ(can->set_filters({}), Status::kOk);
  bus.put(0x10041A2A | CAN_EFF_FLAG, {1});
  EXPECT_EQ(can->receive(Duration::from_ms(20)).status(), Status::kNotReady) << "without filters there is nothing";
  const std::array<CanFilter, LinuxCanSocket::kMaxFilters + 1> many{};
  EXPECT_EQ(can->set_filters(many), Status::kFull);
}

TEST(KernelCanSocket, WaitsAsLongAsItSaysAndNoLonger) {
  PLUMB_NEEDS_KERNEL("SocketCAN (modules can-raw and vcan)");
  const auto can = open_vcan({kAnyStandard});
  for (const int ms : {0, 1, 30}) {
    const Time before = clock_now();
    EXPECT_EQ(can->receive(Duration::from_ms(ms)).status(), Status::kNotReady);
    EXPECT_GE(clock_now() - before, Duration::from_ms(ms));
    EXPECT_LE(clock_now() - before, Duration::from_ms(ms + 500)) << "generous: the machine may be busy";
  }
}

TEST(KernelCanSocket, Sends) {
  PLUMB_NEEDS_KERNEL("SocketCAN (modules can-raw and vcan)");
  const auto can = open_vcan({});
  const Bus bus;
  ASSERT_EQ(can->send({.id = 0x1001552A, .is_extended = true, .size = 2, .bytes = {7, 8}}), Status::kOk);
  const can_frame sent = bus.take();
  EXPECT_EQ(sent.can_id, 0x1001552A | CAN_EFF_FLAG);
  EXPECT_EQ(sent.can_dlc, 2);
  EXPECT_EQ(sent.data[1], 8);
  EXPECT_EQ(can->health().sent, 1U);
  EXPECT_EQ(can->send({.id = 0x800, .is_extended = false, .size = 0, .bytes = {}}), Status::kInvalidValue);
  EXPECT_EQ(can->send({.id = 0x20000000, .is_extended = true, .size = 0, .bytes = {}}), Status::kInvalidValue);
  EXPECT_EQ(can->send({.id = 0x1, .is_extended = false, .size = 9, .bytes = {}}), Status::kInvalidValue);
}

// A virtual interface has no controller that fails, but it carries the frames by which one reports.
TEST(KernelCanSocket, FollowsTheControllerThroughBusOffAndBack) {
  PLUMB_NEEDS_KERNEL("SocketCAN (modules can-raw and vcan)");
  const auto can = open_vcan({kAnyStandard});
  const Bus bus;
  const auto state_after = [&] {
    EXPECT_EQ(can->receive(Duration::from_ms(20)).status(), Status::kNotReady) << "an error frame is no data";
    return can->health().state;
  };
  bus.put_state(CAN_ERR_CRTL_TX_WARNING);
  EXPECT_EQ(state_after(), CanState::kWarning);
  bus.put_state(CAN_ERR_CRTL_RX_PASSIVE);
  EXPECT_EQ(state_after(), CanState::kPassive);
  bus.put(CAN_ERR_FLAG | CAN_ERR_BUSOFF, {0, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(state_after(), CanState::kBusOff);
  EXPECT_EQ(can->send({.id = 1, .is_extended = false, .size = 0, .bytes = {}}), Status::kRejected);
  bus.put(CAN_ERR_FLAG | CAN_ERR_RESTARTED, {0, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(state_after(), CanState::kActive);
  EXPECT_EQ(can->send({.id = 1, .is_extended = false, .size = 0, .bytes = {}}), Status::kOk);
  bus.put(CAN_ERR_FLAG | CAN_ERR_BUSOFF, {0, 0, 0, 0, 0, 0, 0, 0});
  bus.put(0x77, {5});
  const Result<ReceivedCanFrame> received = can->receive(kLong);
  ASSERT_TRUE(received.has_value()) << "the data frame behind the error frame";
  EXPECT_EQ(received->frame.id, 0x77U);
  EXPECT_EQ(can->health().state, CanState::kActive) << "who hears is on the bus";
  EXPECT_EQ(can->health().bus_offs, 2U);
  EXPECT_EQ(can->health().restarts, 2U);
  EXPECT_EQ(can->health().error_frames, 5U);
}

TEST(KernelCanSocket, SurvivesAnInterfaceThatGoesDownAndUp) {
  PLUMB_NEEDS_KERNEL("SocketCAN (modules can-raw and vcan)");
  const auto can = open_vcan({kAnyStandard});
  shell("ip link set vcan0 down");
  EXPECT_EQ(can->receive(Duration::from_ms(20)).status(), Status::kRejected);
  EXPECT_EQ(can->last_error(), ENETDOWN);
  EXPECT_EQ(can->health().state, CanState::kDown);
  EXPECT_EQ(can->send({.id = 1, .is_extended = false, .size = 0, .bytes = {}}), Status::kRejected);
  shell("ip link set vcan0 up");
  Bus().put(0x55, {});
  EXPECT_TRUE(can->receive(kLong).has_value());
  EXPECT_EQ(can->health().state, CanState::kActive);
  EXPECT_EQ(can->health().restarts, 1U);
}

TEST(KernelCanSocket, SurvivesAnInterfaceThatIsTakenAwayAndComesBack) {
  PLUMB_NEEDS_KERNEL("SocketCAN (modules can-raw and vcan)");
  const auto can = open_vcan({{.id = 0x55, .mask = kCanStandardIdMask, .is_extended = false}});
  shell("ip link del vcan0");
  for (int i = 0; i < 5; ++i) EXPECT_FALSE(can->receive(Duration::from_ms(5)).has_value());
  EXPECT_EQ(can->health().state, CanState::kDown);
  shell("ip link add vcan0 type vcan && ip link set vcan0 up");
  const Time end = clock_now() + Duration::from_ms(2000);
  Result<ReceivedCanFrame> received = Status::kNotReady;
  while (!received && clock_now() < end) {
    Bus().put(0x54, {});  // the filter is still in force
    Bus().put(0x55, {});
    received = can->receive(Duration::from_ms(20));
  }
  ASSERT_TRUE(received.has_value());
  EXPECT_EQ(received->frame.id, 0x55U);
  EXPECT_EQ(can->health().state, CanState::kActive);
}

TEST(KernelCanSocket, CountsFramesThatNobodyTookInTime) {
  PLUMB_NEEDS_KERNEL("SocketCAN (modules can-raw and vcan)");
  const auto can = open_vcan({kAnyStandard});
  const Bus bus;
  constexpr std::uint32_t kSent = 5000;
  // With pauses, because the kernel's queue ahead of all sockets holds 1000 frames, and what it drops no socket is
  // told.
  constexpr std::uint32_t kAtOnce = 500;
  for (std::uint32_t i = 0; i < kSent; ++i) {
    bus.put(0x123, {});
    if (i % kAtOnce == 0) usleep(1'000);
  }
  while (can->receive(Duration()).has_value()) {
  }
  bus.put(0x123, {});  // carries the count of what was lost before it
  ASSERT_TRUE(can->receive(kLong).has_value());
  EXPECT_GT(can->health().overflows, 0U);
  EXPECT_EQ(can->health().received + can->health().overflows, kSent + 1);
}

}  // namespace
}  // namespace plumb
