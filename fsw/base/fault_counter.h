#pragma once
// How often something was wrong, and what it was.

#include <cstdint>

namespace plumb {

/// Two numbers as one value, the first in the upper 32 bits.
constexpr std::int64_t value_pair(std::uint32_t first, std::uint32_t second) {
  return static_cast<std::int64_t>(std::uint64_t{first} << 32U | second);
}

struct FaultCounter {
  std::uint64_t count = 0;
  std::int64_t value = 0;  ///< the wrong one of the last time; 0 where there is none to tell

  constexpr FaultCounter() = default;
  constexpr FaultCounter(std::uint64_t counted, std::int64_t last = 0) : count(counted), value(last) {}

  /// Once more or, where one value stands for many, `times` more.
  constexpr void add(std::int64_t wrong, std::uint64_t times = 1) {
    count += times;
    value = wrong;
  }
  constexpr operator std::uint64_t() const { return count; }
};

}  // namespace plumb
