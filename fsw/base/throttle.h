#pragma once
// Keeps something that may go wrong thousands of times from being told thousands of times.

#include <cstdint>

#include "fsw/base/time.h"

namespace plumb {

/// A bucket of `burst` tokens, one more each `period` of the time that it is asked at. An occurrence takes a token and
/// is told; without one it is only counted.
class Throttle {
 public:
  constexpr Throttle(std::uint32_t burst, Duration period) : burst_(burst), period_(period), tokens_(burst) {}

  /// Whether the occurrence at `t` is to be told. suppressed() is then the number of those before it that were not.
  constexpr bool admit(Time t) {
    if (told_all_) suppressed_ = 0;
    told_all_ = false;
    refill(t);
    if (tokens_ == 0) {
      ++suppressed_;
      return false;
    }
    --tokens_;
    told_all_ = true;
    return true;
  }

  constexpr std::uint64_t suppressed() const { return suppressed_; }

 private:
  constexpr void refill(Time t) {
    if (tokens_ == burst_) {  // a full bucket does not gather time
      t_refilled_ = t;
      return;
    }
    const std::int64_t periods = (t - t_refilled_).ns() / period_.ns();
    if (periods <= 0) return;
    t_refilled_ = t_refilled_ + period_ * periods;
    tokens_ = periods >= burst_ - tokens_ ? burst_ : tokens_ + static_cast<std::uint32_t>(periods);
  }

  std::uint32_t burst_;
  Duration period_;
  std::uint32_t tokens_;
  Time t_refilled_;
  bool told_all_ = false;
  std::uint64_t suppressed_ = 0;
};

}  // namespace plumb
