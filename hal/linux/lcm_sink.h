#pragma once
// Telemetry over LCM. Once it is open, publishing from an encoded buffer does not call the allocator (a test counts the
// calls), so it is fit for flight threads.

#include <cstdint>
#include <memory>
#include <string>

#include "hal/include/telemetry_sink.h"

typedef struct _lcm_t lcm_t;

namespace plumb {

class LcmSink final : public TelemetrySink {
 public:
  /// `url` as LCM takes it, for example "udpm://239.255.76.67:7667?ttl=0" (ttl 0 stays on this host). Null, and the
  /// reason in `error`, when LCM cannot use it: a malformed URL, or no multicast route to the address.
  static std::unique_ptr<LcmSink> open(const std::string& url, std::string& error);
  ~LcmSink() override;
  LcmSink(const LcmSink&) = delete;
  LcmSink& operator=(const LcmSink&) = delete;

  Status publish(const char* channel, std::span<const std::uint8_t> message) override;
  /// Messages that the transport refused.
  std::uint64_t lost() const { return lost_; }
  int last_error() const override { return last_error_; }

  /// The connection, for a subscriber in the same process ("memq://").
  lcm_t* handle() { return lcm_; }

 private:
  explicit LcmSink(lcm_t* lcm) : lcm_(lcm) {}
  lcm_t* lcm_;
  std::uint64_t lost_ = 0;
  int last_error_ = 0;
};

}  // namespace plumb
