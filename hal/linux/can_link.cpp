#include "hal/linux/can_link.h"

#include <linux/can/netlink.h>
#include <linux/if_link.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cstring>
#include <string_view>

namespace plumb {
namespace {

/// The attribute of this type among those in `size` bytes from `first` on; null where there is none.
const rtattr* find(const rtattr* first, std::size_t size, unsigned type) {
  auto left = static_cast<int>(size);
  for (const rtattr* at = first; RTA_OK(at, left); at = RTA_NEXT(at, left)) {
    if ((at->rta_type & static_cast<unsigned>(NLA_TYPE_MASK)) == type) return at;
  }
  return nullptr;
}
const rtattr* find_in(const rtattr* nest, unsigned type) {
  return nest == nullptr ? nullptr : find(static_cast<const rtattr*>(RTA_DATA(nest)), RTA_PAYLOAD(nest), type);
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
  const int file = request.link.ifi_index == 0 ? -1 : socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC, NETLINK_ROUTE);
  if (file < 0) return std::nullopt;
  constexpr std::size_t kMaxAnswerBytes = 16384;
  alignas(nlmsghdr) std::array<char, kMaxAnswerBytes> answer{};
  const bool asked = send(file, &request, sizeof request, 0) == static_cast<ssize_t>(sizeof request);
  const ssize_t size = asked ? recv(file, answer.data(), answer.size(), 0) : -1;  // the system answers at once
  close(file);
  const auto* header = reinterpret_cast<const nlmsghdr*>(answer.data());
  if (size < 0 || !NLMSG_OK(header, static_cast<std::size_t>(size)) || header->nlmsg_type != RTM_NEWLINK) {
    return std::nullopt;
  }
  const auto* link = static_cast<const ifinfomsg*>(NLMSG_DATA(header));
  const rtattr* const info = find(IFLA_RTA(link), IFLA_PAYLOAD(header), IFLA_LINKINFO);
  const rtattr* const kind = find_in(info, IFLA_INFO_KIND);  // what the data means depends on it
  const rtattr* const delay = find_in(find_in(info, IFLA_INFO_DATA), IFLA_CAN_RESTART_MS);
  std::uint32_t delay_ms = 0;
  if (kind == nullptr || std::string_view(static_cast<const char*>(RTA_DATA(kind))) != "can") return std::nullopt;
  if (delay == nullptr || RTA_PAYLOAD(delay) != sizeof delay_ms) return std::nullopt;
  std::memcpy(&delay_ms, RTA_DATA(delay), sizeof delay_ms);
  return delay_ms;
}

}  // namespace plumb
