#include "hal/linux/can_link.h"

#include <linux/can/netlink.h>
#include <linux/if_link.h>
#include <net/if.h>

#include <cstring>
#include <string_view>

#include "hal/linux/route_netlink.h"

namespace plumb {
namespace {

const rtattr* find_in(const rtattr* nest, unsigned type) {
  return nest == nullptr ? nullptr
                         : find_attribute(static_cast<const rtattr*>(RTA_DATA(nest)), RTA_PAYLOAD(nest), type);
}

}  // namespace

std::optional<std::uint32_t> can_restart_delay_ms(const std::string& interface_name) {
  struct {
    nlmsghdr header;
    ifinfomsg link;
  } request{};
  request.header.nlmsg_len = sizeof request;
  request.header.nlmsg_type = RTM_GETLINK;
  request.header.nlmsg_flags = NLM_F_REQUEST;
  request.link.ifi_index = static_cast<int>(if_nametoindex(interface_name.c_str()));
  if (request.link.ifi_index == 0) return std::nullopt;
  RouteAnswer answer;
  const nlmsghdr* const header = ask_kernel(request, RTM_NEWLINK, answer);
  if (header == nullptr) return std::nullopt;
  const auto* link = static_cast<const ifinfomsg*>(NLMSG_DATA(header));
  const rtattr* const info = find_attribute(IFLA_RTA(link), IFLA_PAYLOAD(header), IFLA_LINKINFO);
  const rtattr* const kind = find_in(info, IFLA_INFO_KIND);  // what the data means depends on it
  const rtattr* const delay = find_in(find_in(info, IFLA_INFO_DATA), IFLA_CAN_RESTART_MS);
  std::uint32_t delay_ms = 0;
  if (kind == nullptr || std::string_view(static_cast<const char*>(RTA_DATA(kind))) != "can") return std::nullopt;
  if (delay == nullptr || RTA_PAYLOAD(delay) != sizeof delay_ms) return std::nullopt;
  std::memcpy(&delay_ms, RTA_DATA(delay), sizeof delay_ms);
  return delay_ms;
}

}  // namespace plumb
