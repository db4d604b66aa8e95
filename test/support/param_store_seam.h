#pragma once
// Memory that fails: what tests do to the copies of a parameter store.

#include "fsw/params/param_store.h"

namespace plumb {

struct ParamStoreSeam {
  template <class S>
  static S& active(ParamStore<S>& store) {
    return store.active_;
  }
  template <class S>
  static S& standby(ParamStore<S>& store) {
    return store.standby_;
  }
  template <class S>
  static std::uint32_t& checksum(ParamStore<S>& store) {
    return store.crc_;
  }
};

namespace test {

/// The value with one of its bits turned over.
inline double with_bit_flipped(double value, unsigned bit) {
  return std::bit_cast<double>(std::bit_cast<std::uint64_t>(value) ^ (std::uint64_t{1} << bit));
}

}  // namespace test
}  // namespace plumb
