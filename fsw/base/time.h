#pragma once
// Time as integer nanoseconds, in two strong types: Time is an instant on the one flight clock (CLOCK_MONOTONIC live,
// the log's own stamps in replay), Duration a difference of instants. Arithmetic saturates at the ends of the int64
// range instead of wrapping, so that a corrupt stamp can never turn the future into the past.

#include <compare>
#include <cstdint>
#include <limits>

namespace plumb {

namespace detail {
constexpr std::int64_t saturating_add(std::int64_t a, std::int64_t b) {
  std::int64_t sum = 0;
  if (!__builtin_add_overflow(a, b, &sum)) return sum;
  return b > 0 ? std::numeric_limits<std::int64_t>::max() : std::numeric_limits<std::int64_t>::min();
}
constexpr std::int64_t saturating_sub(std::int64_t a, std::int64_t b) {
  std::int64_t difference = 0;
  if (!__builtin_sub_overflow(a, b, &difference)) return difference;
  return b < 0 ? std::numeric_limits<std::int64_t>::max() : std::numeric_limits<std::int64_t>::min();
}
constexpr std::int64_t saturating_mul(std::int64_t a, std::int64_t b) {
  std::int64_t product = 0;
  if (!__builtin_mul_overflow(a, b, &product)) return product;
  return (a < 0) == (b < 0) ? std::numeric_limits<std::int64_t>::max() : std::numeric_limits<std::int64_t>::min();
}
}  // namespace detail

inline constexpr std::int64_t kNsPerSecond = 1'000'000'000;

class Duration {
 public:
  constexpr Duration() = default;
  static constexpr Duration from_ns(std::int64_t ns) { return Duration(ns); }
  static constexpr Duration from_us(std::int64_t us) { return Duration(detail::saturating_mul(us, 1'000)); }
  static constexpr Duration from_ms(std::int64_t ms) { return Duration(detail::saturating_mul(ms, 1'000'000)); }
  /// Nearest nanosecond; out-of-range values saturate, not-a-number becomes zero.
  static constexpr Duration from_seconds(double s) {
    constexpr double kLimit = 9.2e9;  // seconds, just inside the int64 range in ns
    if (s != s) return Duration(0);
    if (s >= kLimit) return max();
    if (s <= -kLimit) return min();
    return Duration(static_cast<std::int64_t>(s * 1e9 + (s < 0 ? -0.5 : 0.5)));
  }
  static constexpr Duration max() { return Duration(std::numeric_limits<std::int64_t>::max()); }
  static constexpr Duration min() { return Duration(std::numeric_limits<std::int64_t>::min()); }

  constexpr std::int64_t ns() const { return ns_; }
  constexpr double seconds() const { return static_cast<double>(ns_) * 1e-9; }

  constexpr Duration operator-() const { return Duration(detail::saturating_sub(0, ns_)); }
  friend constexpr Duration operator+(Duration a, Duration b) { return Duration(detail::saturating_add(a.ns_, b.ns_)); }
  friend constexpr Duration operator-(Duration a, Duration b) { return Duration(detail::saturating_sub(a.ns_, b.ns_)); }
  friend constexpr Duration operator*(Duration a, std::int64_t k) { return Duration(detail::saturating_mul(a.ns_, k)); }
  /// Towards zero. Precondition: k is above 0.
  friend constexpr Duration operator/(Duration a, std::int64_t k) { return Duration(a.ns_ / k); }
  friend constexpr auto operator<=>(Duration, Duration) = default;

 private:
  explicit constexpr Duration(std::int64_t ns) : ns_(ns) {}
  std::int64_t ns_ = 0;
};

class Time {
 public:
  constexpr Time() = default;
  static constexpr Time from_ns(std::int64_t ns) { return Time(ns); }
  static constexpr Time from_seconds(double s) { return Time(Duration::from_seconds(s).ns()); }
  /// Later than every measurement.
  static constexpr Time max() { return Time(std::numeric_limits<std::int64_t>::max()); }
  /// Earlier than every measurement; the value of "never happened".
  static constexpr Time never() { return Time(std::numeric_limits<std::int64_t>::min()); }

  constexpr std::int64_t ns() const { return ns_; }
  constexpr double seconds() const { return static_cast<double>(ns_) * 1e-9; }

  friend constexpr Time operator+(Time t, Duration d) { return Time(detail::saturating_add(t.ns_, d.ns())); }
  friend constexpr Time operator-(Time t, Duration d) { return Time(detail::saturating_sub(t.ns_, d.ns())); }
  friend constexpr Duration operator-(Time a, Time b) {
    return Duration::from_ns(detail::saturating_sub(a.ns_, b.ns_));
  }
  friend constexpr auto operator<=>(Time, Time) = default;

 private:
  explicit constexpr Time(std::int64_t ns) : ns_(ns) {}
  std::int64_t ns_ = std::numeric_limits<std::int64_t>::min();
};

}  // namespace plumb
