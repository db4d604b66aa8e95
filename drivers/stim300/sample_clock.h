#pragma once
// When the unit took a sample, from when its datagram arrived.
//
// A datagram never arrives too early, but the host may see it late: by the scheduler, by a USB adapter, by several
// milliseconds. The unit's own counter has no such noise, so the time of a sample is counted on from the datagrams that
// came with the least delay, and follows an earlier one at once. Later ones move it only as fast as two crystals may
// drift apart.

#include <cstdint>

#include "fsw/base/time.h"

namespace plumb::stim300 {

class SampleClock {
 public:
  struct Tick {
    Time t;                    ///< of the sample: end of its internal period, before filter delays
    std::int64_t elapsed = 0;  ///< internal samples since the last tick; 0: the same one again
    bool first = false;        ///< nothing to count from; elapsed has no meaning
  };

  /// A datagram with that counter, and when its sample was taken as far as its arrival tells (wire time and the latency
  /// it states taken off). `t_silent` is when the line last had nothing to read: it tells a gap, in which the counter
  /// may have turned round unseen, from datagrams that waited for a host that was away.
  Tick update(std::uint8_t counter, Time t_observed, Time t_silent);
  /// The unit began anew: its counter tells nothing of what was before.
  void restart() { running_ = false; }
  /// How often the count was given up because datagrams came later than it for a quarter of a second or longer.
  std::uint32_t corrections() const { return corrections_; }

 private:
  Time follow(Time t_counted, Duration elapsed, Time t_observed);

  bool running_ = false;
  std::uint8_t counter_ = 0;
  Time t_;             ///< of the last tick
  Time t_late_since_;  ///< since when every datagram came late; never(): the last one did not
  std::uint32_t corrections_ = 0;
};

}  // namespace plumb::stim300
