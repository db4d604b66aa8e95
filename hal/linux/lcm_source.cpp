#include "hal/linux/lcm_source.h"

#include <arpa/inet.h>
#include <lcm/lcm.h>
#include <net/if.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "hal/linux/route_netlink.h"

namespace plumb {
namespace {

// A few commands that came while the thread was away; LCM would keep 30.
constexpr int kQueue = 8;

void keep(const lcm_recv_buf_t* buffer, const char*, void* message) {
  const auto* data = static_cast<const std::uint8_t*>(buffer->data);
  static_cast<std::vector<std::uint8_t>*>(message)->assign(data, data + buffer->data_size);
}

/// Asks the kernel for the interface by which it would send to the address. 0: there is none.
unsigned interface_towards(in_addr address) {
  struct {
    nlmsghdr head;
    rtmsg route;
    rtattr attribute;
    in_addr destination;
  } request{};
  request.head.nlmsg_len = sizeof request;
  request.head.nlmsg_type = RTM_GETROUTE;
  request.head.nlmsg_flags = NLM_F_REQUEST;
  request.route.rtm_family = AF_INET;
  request.route.rtm_dst_len = 32;
  request.attribute.rta_len = RTA_LENGTH(sizeof address);
  request.attribute.rta_type = RTA_DST;
  request.destination = address;
  RouteAnswer answer;
  const nlmsghdr* const head = ask_kernel(request, RTM_NEWROUTE, answer);
  if (head == nullptr) return 0;
  const auto* found = static_cast<const rtmsg*>(NLMSG_DATA(head));
  const rtattr* const interface = find_attribute(RTM_RTA(found), RTM_PAYLOAD(head), RTA_OIF);
  unsigned index = 0;
  if (interface != nullptr) std::memcpy(&index, RTA_DATA(interface), sizeof index);
  return index;
}

bool is_loopback(unsigned interface) {
  ifreq request{};
  const int any = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const bool known =
      any >= 0 && if_indextoname(interface, request.ifr_name) != nullptr && ioctl(any, SIOCGIFFLAGS, &request) == 0;
  if (any >= 0) close(any);
  return known && (request.ifr_flags & IFF_LOOPBACK) != 0;
}

/// The address in a URL udpm://ADDRESS:PORT. False: it is none.
bool address_of(const std::string& url, in_addr& address) {
  const std::string scheme = "udpm://";
  if (!url.starts_with(scheme)) return false;
  const std::string place = url.substr(scheme.size(), url.find('?') - scheme.size());
  return inet_pton(AF_INET, place.substr(0, place.find(':')).c_str(), &address) == 1;
}

}  // namespace

bool stays_on_host(const std::string& url) {
  in_addr group{};
  return address_of(url, group) && is_loopback(interface_towards(group));
}

bool is_lcm_url(const std::string& url) {
  if (lcm_t* lcm = lcm_create(url.c_str()); lcm != nullptr) {
    lcm_destroy(lcm);
    return true;
  }
  in_addr group{};
  return address_of(url, group) && IN_MULTICAST(ntohl(group.s_addr));
}

std::unique_ptr<LcmSource> LcmSource::open(const std::string& url, const std::string& channel, std::string& error) {
  lcm_t* lcm = lcm_create(url.c_str());
  if (lcm == nullptr) {
    error = "LCM cannot use '" + url + "'";
    return nullptr;
  }
  std::unique_ptr<LcmSource> source(new LcmSource(lcm));
  lcm_subscription_t* subscription = lcm_subscribe(lcm, channel.c_str(), keep, &source->message_);
  if (subscription != nullptr && lcm_subscription_set_queue_capacity(subscription, kQueue) == 0) return source;
  error = "LCM cannot subscribe to '" + channel + "'";
  return nullptr;
}

LcmSource::~LcmSource() { lcm_destroy(lcm_); }

Result<std::span<const std::uint8_t>> LcmSource::receive(Duration timeout) {
  errno = 0;
  const int handled = lcm_handle_timeout(lcm_, static_cast<int>(timeout.ns() / 1'000'000));
  if (handled < 0) {
    last_error_ = errno;
    return Status::kRejected;
  }
  if (handled == 0) return Status::kNotReady;
  return std::span<const std::uint8_t>(message_);
}

}  // namespace plumb
