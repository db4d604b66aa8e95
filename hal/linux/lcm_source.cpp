#include "hal/linux/lcm_source.h"

#include <arpa/inet.h>
#include <lcm/lcm.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdlib>

namespace plumb {
namespace {

// A few commands that came while the thread was away; LCM would keep 30.
constexpr int kQueue = 8;

void keep(const lcm_recv_buf_t* buffer, const char*, void* message) {
  const auto* data = static_cast<const std::uint8_t*>(buffer->data);
  static_cast<std::vector<std::uint8_t>*>(message)->assign(data, data + buffer->data_size);
}

bool is_loopback(const sockaddr_in& address) { return (ntohl(address.sin_addr.s_addr) >> 24U) == IN_LOOPBACKNET; }

}  // namespace

bool stays_on_host(const std::string& url) {
  const std::string scheme = "udpm://";
  if (!url.starts_with(scheme)) return false;
  const std::string place = url.substr(scheme.size(), url.find('?') - scheme.size());
  const std::size_t colon = place.find(':');
  sockaddr_in group{};
  group.sin_family = AF_INET;
  group.sin_port = htons(static_cast<std::uint16_t>(colon == std::string::npos ? 0 : std::atoi(&place[colon + 1])));
  if (inet_pton(AF_INET, place.substr(0, colon).c_str(), &group.sin_addr) != 1) return false;
  // A datagram socket that is connected sends nothing, but knows by which interface it would.
  const int probe = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in own{};
  socklen_t size = sizeof own;
  const bool routed = probe >= 0 && connect(probe, reinterpret_cast<const sockaddr*>(&group), sizeof group) == 0 &&
                      getsockname(probe, reinterpret_cast<sockaddr*>(&own), &size) == 0;
  if (probe >= 0) close(probe);
  return routed && is_loopback(own);
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
  const int handled = lcm_handle_timeout(lcm_, static_cast<int>(timeout.ns() / 1'000'000));
  if (handled < 0) return Status::kRejected;
  if (handled == 0) return Status::kNotReady;
  return std::span<const std::uint8_t>(message_);
}

}  // namespace plumb
