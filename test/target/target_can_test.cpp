// What a virtual CAN interface does not have: a controller, here QEMU's SJA1000 behind can0.

#include <gtest/gtest.h>
#include <linux/can/netlink.h>
#include <linux/if_link.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>

#include "hal/linux/can_link.h"
#include "test/unit/hal/kernel_part.h"

namespace plumb {
namespace {

constexpr std::array<char, 4> kKind = {'c', 'a', 'n', '\0'};

/// As `ip link set can0 type can restart-ms N`, which busybox does not know.
void set_restart_delay(std::uint32_t delay_ms) {
  struct {
    nlmsghdr header;
    ifinfomsg link;
    rtattr info;
    rtattr kind;
    std::array<char, 4> kind_value;
    rtattr data;
    rtattr delay;
    std::uint32_t delay_value;
  } request{};
  constexpr auto kHead = static_cast<unsigned short>(sizeof(rtattr));
  constexpr auto kPair = static_cast<unsigned short>(kHead + sizeof(std::uint32_t));
  request.header.nlmsg_len = sizeof request;
  request.header.nlmsg_type = RTM_NEWLINK;
  request.header.nlmsg_flags = NLM_F_REQUEST | NLM_F_ACK;
  request.link.ifi_index = static_cast<int>(if_nametoindex("can0"));
  request.delay = {.rta_len = kPair, .rta_type = IFLA_CAN_RESTART_MS};
  request.delay_value = delay_ms;
  request.data = {.rta_len = kHead + kPair, .rta_type = IFLA_INFO_DATA};
  request.kind = {.rta_len = kPair, .rta_type = IFLA_INFO_KIND};
  request.kind_value = kKind;
  request.info = {.rta_len = kHead + kPair + kHead + kPair, .rta_type = IFLA_LINKINFO};
  const int file = socket(AF_NETLINK, SOCK_RAW, NETLINK_ROUTE);
  ASSERT_EQ(send(file, &request, sizeof request, 0), static_cast<ssize_t>(sizeof request));
  struct {
    nlmsghdr header;
    nlmsgerr error;
  } answer{};
  ASSERT_GE(recv(file, &answer, sizeof answer, 0), static_cast<ssize_t>(sizeof answer));
  EXPECT_EQ(answer.error.error, 0);
  close(file);
}

TEST(TargetCanLink, TellsWhetherTheSystemRestartsTheController) {
  PLUMB_NEEDS_KERNEL("everything");
  for (const std::uint32_t delay_ms : {100U, 1U, 0U}) {
    set_restart_delay(delay_ms);
    EXPECT_EQ(can_restart_delay_ms("can0"), delay_ms);
  }
  EXPECT_EQ(can_restart_delay_ms("vcan0"), std::nullopt) << "it has no controller";
  EXPECT_EQ(can_restart_delay_ms("lo"), std::nullopt);
  EXPECT_EQ(can_restart_delay_ms("nonsense7"), std::nullopt);
}

}  // namespace
}  // namespace plumb
