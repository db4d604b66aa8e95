#pragma once
// Messages of one channel from LCM. LCM receives in a thread of its own and takes memory as it likes, so this belongs
// into a thread beside those that fly.

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "fsw/base/status.h"
#include "fsw/base/time.h"

typedef struct _lcm_t lcm_t;

namespace plumb {

/// Whether what LCM sends to `url`, and what reaches it from there, crosses no network: the route to the multicast
/// group is a loopback. A ttl of 0 alone keeps this host's messages here, not those of others out.
bool stays_on_host(const std::string& url);

/// Whether LCM can use a URL: at once or, of a multicast group, when this host has a route to it.
bool is_lcm_url(const std::string& url);

class LcmSource {
 public:
  /// Null, and the reason in `error`, when LCM cannot use the URL.
  static std::unique_ptr<LcmSource> open(const std::string& url, const std::string& channel, std::string& error);
  ~LcmSource();
  LcmSource(const LcmSource&) = delete;
  LcmSource& operator=(const LcmSource&) = delete;

  /// The next message, until the call after this. kNotReady: none within `timeout`. kRejected: LCM has failed, at once.
  Result<std::span<const std::uint8_t>> receive(Duration timeout);
  /// The system's error number (errno) of the last receive() that LCM failed in; 0 when none has, or it gave no reason.
  int last_error() const { return last_error_; }

 private:
  explicit LcmSource(lcm_t* lcm) : lcm_(lcm) {}
  lcm_t* lcm_;
  std::vector<std::uint8_t> message_;
  int last_error_ = 0;
};

}  // namespace plumb
