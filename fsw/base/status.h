#pragma once
// Results of calls that can fail because of the world. Bugs are PLUMB_ASSERT; "nothing yet" is Status::kNotReady where
// a caller polls, and otherwise an empty container, never an error.

#include <cstdint>
#include <type_traits>

#include "fsw/base/assert.h"

namespace plumb {

enum class [[nodiscard]] Status : std::uint8_t {
  kOk = 0,
  kNotReady,        ///< nothing to do yet; ask again later
  kInvalidValue,    ///< an argument or datum outside its documented range, or not finite
  kOutOfOrder,      ///< a time stamp at or before one already used
  kStale,           ///< a measurement older than its age limit
  kFull,            ///< a fixed capacity is used up
  kRejected,        ///< a measurement failed its gate
  kIllConditioned,  ///< the data cannot determine what was asked for
  kNumericalFault,  ///< non-finite number or indefinite covariance
};

constexpr bool ok(Status status) { return status == Status::kOk; }
/// A lower-case name for logs; "unknown" for a byte that is no Status.
const char* to_string(Status status);

/// A value or the reason there is none. T must be default-constructible and trivially destructible.
template <typename T>
class [[nodiscard]] Result {
  static_assert(std::is_default_constructible_v<T>, "a Result without a value still holds a T");
  static_assert(std::is_trivially_destructible_v<T>, "a Result carries plain data, not something to clean up");

 public:
  constexpr Result(const T& value) : value_(value), status_(Status::kOk) {}
  /// Precondition: not kOk, which needs a value.
  constexpr Result(Status status) : status_(status) { PLUMB_ASSERT(status != Status::kOk); }

  constexpr bool has_value() const { return status_ == Status::kOk; }
  constexpr explicit operator bool() const { return has_value(); }
  constexpr Status status() const { return status_; }

  /// Precondition: has_value().
  constexpr const T& value() const {
    PLUMB_ASSERT(has_value());
    return value_;
  }
  constexpr const T& operator*() const { return value(); }
  constexpr const T* operator->() const { return &value(); }

 private:
  T value_{};
  Status status_;
};

}  // namespace plumb
