#include "hal/linux/lcm_sink.h"

#include <lcm/lcm.h>

#include <cerrno>
#include <limits>

namespace plumb {

std::unique_ptr<LcmSink> LcmSink::open(const std::string& url, std::string& error) {
  lcm_t* lcm = lcm_create(url.c_str());
  if (lcm == nullptr) {
    error = "LCM cannot use '" + url +
            "'; expected a URL such as udpm://239.255.76.67:7667?ttl=0 and a network route " +
            "to its address (on a host without one: ip route add 224.0.0.0/4 dev lo)";
    return nullptr;
  }
  // LCM makes its lock, from the heap, when the first message goes out: that is to be before the flight. LCM's
  // receivers send the same message when they begin. Where nobody is there to take it yet, later messages may be taken.
  constexpr char kSelfTest[] = "lcm self test";
  static_cast<void>(lcm_publish(lcm, "LCM_SELF_TEST", kSelfTest, sizeof kSelfTest));
  return std::unique_ptr<LcmSink>(new LcmSink(lcm));
}

LcmSink::~LcmSink() { lcm_destroy(lcm_); }

Status LcmSink::publish(const char* channel, std::span<const std::uint8_t> message) {
  if (message.size() > std::numeric_limits<unsigned int>::max()) return Status::kInvalidValue;
  const int sent = lcm_publish(lcm_, channel, message.data(), static_cast<unsigned int>(message.size()));
  if (sent == 0) return Status::kOk;
  last_error_ = errno;
  ++lost_;
  return Status::kRejected;
}

}  // namespace plumb
