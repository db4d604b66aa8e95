#pragma once
// Questions to the kernel about its interfaces and routes (rtnetlink), which it answers at once.

#include <linux/rtnetlink.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cstddef>
#include <cstdint>

namespace plumb {

struct RouteAnswer {
  alignas(nlmsghdr) std::array<char, 16384> bytes{};
};

/// The answer to a request, which begins with its nlmsghdr. Null: there is none of this type.
template <class Request>
const nlmsghdr* ask_kernel(const Request& request, std::uint16_t type, RouteAnswer& answer) {
  const int kernel = socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC, NETLINK_ROUTE);
  const bool sent = kernel >= 0 && send(kernel, &request, sizeof request, 0) == static_cast<ssize_t>(sizeof request);
  const ssize_t size = sent ? recv(kernel, answer.bytes.data(), answer.bytes.size(), 0) : -1;
  if (kernel >= 0) close(kernel);
  const auto* head = reinterpret_cast<const nlmsghdr*>(answer.bytes.data());
  const bool whole = size >= 0 && NLMSG_OK(head, static_cast<std::size_t>(size));
  return whole && head->nlmsg_type == type ? head : nullptr;
}

/// The attribute of this type among those in `size` bytes from `first` on; null where there is none.
inline const rtattr* find_attribute(const rtattr* first, std::size_t size, unsigned type) {
  auto left = static_cast<int>(size);
  for (const rtattr* at = first; RTA_OK(at, left); at = RTA_NEXT(at, left)) {
    if ((at->rta_type & static_cast<unsigned>(NLA_TYPE_MASK)) == type) return at;
  }
  return nullptr;
}

}  // namespace plumb
