#pragma once
// How many members an aggregate has, so that a test can tell when a list of them elsewhere has fallen behind.

#include <cstddef>
#include <utility>

namespace plumb::test {

namespace detail {

// Converts to anything: with as many of these as T has members T can be initialised, with one more it cannot.
struct Anything {
  template <typename T>
  operator T() const;
};

template <typename T, std::size_t... I>
constexpr bool initialisable(std::index_sequence<I...>) {
  return requires { T{(static_cast<void>(I), Anything{})...}; };
}

}  // namespace detail

/// Number of members of the aggregate T. T must not hold plain arrays, whose elements would be counted one by one.
template <typename T, std::size_t N = 0>
constexpr std::size_t member_count() {
  if constexpr (detail::initialisable<T>(std::make_index_sequence<N + 1>{})) {
    return member_count<T, N + 1>();
  } else {
    return N;
  }
}

}  // namespace plumb::test
