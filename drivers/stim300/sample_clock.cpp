#include "drivers/stim300/sample_clock.h"

#include <algorithm>

#include "drivers/stim300/configuration.h"

namespace plumb::stim300 {
namespace {

constexpr std::int64_t kCounterTurn = 256;
// Ten times what crystals do; in a tenth of a second without a prompt datagram it makes 50 us.
constexpr std::int64_t kMaxDrift_ppm = 500;
// Datagrams that come later than this for so long are not delayed: the count is wrong.
constexpr Duration kLate = Duration::from_ms(5);
constexpr Duration kMaxLate = Duration::from_ms(250);

// Internal samples from one datagram to the next: what the counter says modulo 256, and the turns that fit into the
// time in which nothing came, known to half a turn, 64 ms.
std::int64_t count_samples(std::uint8_t from, std::uint8_t to, Duration silent) {
  const std::int64_t step = static_cast<std::uint8_t>(to - from);
  constexpr Duration kTurn = kInternalPeriod * kCounterTurn;
  const Duration rest = silent - kInternalPeriod * step + kTurn / 2;
  return step + kCounterTurn * (std::max(rest, Duration()).ns() / kTurn.ns());
}

}  // namespace

SampleClock::Tick SampleClock::update(std::uint8_t counter, Time t_observed, Time t_silent) {
  if (!running_) {
    running_ = true;
    counter_ = counter;
    t_ = t_observed;
    t_late_since_ = Time::never();
    return {.t = t_, .elapsed = 0, .first = true};
  }
  const std::int64_t elapsed = count_samples(counter_, counter, std::min(t_silent, t_observed) - t_);
  if (elapsed > 0) {
    const Duration passed = kInternalPeriod * elapsed;
    counter_ = counter;
    t_ = follow(t_ + passed, passed, t_observed);
  }
  return {.t = t_, .elapsed = elapsed, .first = false};
}

Time SampleClock::follow(Time t_counted, Duration elapsed, Time t_observed) {
  const Duration late = t_observed - t_counted;
  if (late <= kLate) {
    t_late_since_ = Time::never();
  } else if (t_late_since_ == Time::never()) {
    t_late_since_ = t_observed;
  } else if (t_observed - t_late_since_ >= kMaxLate) {
    t_late_since_ = Time::never();
    ++corrections_;
    return t_observed;
  }
  constexpr std::int64_t kMillion = 1'000'000;
  const Duration drift = elapsed * kMaxDrift_ppm / kMillion;
  return t_counted + std::min(late, drift);
}

}  // namespace plumb::stim300
