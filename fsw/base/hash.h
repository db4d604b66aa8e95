#pragma once
// A 64-bit fingerprint of numbers, bit for bit: two runs agree in it only if they agree in every bit.

#include <bit>
#include <cstddef>
#include <cstdint>

namespace plumb {

class Hash64 {
 public:
  constexpr void add(std::uint64_t word) {
    state_ = std::rotl(state_ ^ word, 29) * 0x9E3779B97F4A7C15ULL;
    state_ ^= state_ >> 32;
  }
  constexpr void add(double value) { add(std::bit_cast<std::uint64_t>(value)); }
  constexpr void add(const double* values, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) add(values[i]);
  }
  constexpr std::uint64_t value() const { return state_; }

 private:
  std::uint64_t state_ = 0xCBF29CE484222325ULL;
};

}  // namespace plumb
