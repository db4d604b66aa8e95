#pragma once
// A vector with its capacity in its type and its elements inside itself: no heap, no growth, no exceptions.

#include <array>
#include <cstddef>

#include "fsw/base/assert.h"
#include "fsw/base/status.h"

namespace plumb {

/// T must be default-constructible and copyable. Elements past size() keep their last value and are never read.
template <typename T, std::size_t Capacity>
class FixedVector {
  static_assert(Capacity > 0, "a FixedVector needs room for at least one element");

 public:
  using value_type = T;
  using iterator = T*;
  using const_iterator = const T*;

  static constexpr std::size_t capacity() { return Capacity; }
  constexpr std::size_t size() const { return size_; }
  constexpr bool empty() const { return size_ == 0; }
  constexpr bool full() const { return size_ == Capacity; }

  constexpr iterator begin() { return items_.data(); }
  constexpr iterator end() { return items_.data() + size_; }
  constexpr const_iterator begin() const { return items_.data(); }
  constexpr const_iterator end() const { return items_.data() + size_; }
  constexpr T* data() { return items_.data(); }
  constexpr const T* data() const { return items_.data(); }

  constexpr T& operator[](std::size_t i) {
    PLUMB_ASSERT(i < size_);
    return items_[i];
  }
  constexpr const T& operator[](std::size_t i) const {
    PLUMB_ASSERT(i < size_);
    return items_[i];
  }
  constexpr T& front() { return (*this)[0]; }
  constexpr const T& front() const { return (*this)[0]; }
  constexpr T& back() { return (*this)[size_ - 1]; }
  constexpr const T& back() const { return (*this)[size_ - 1]; }

  /// kFull, and nothing changed, when there is no room.
  constexpr Status push_back(const T& item) {
    if (full()) return Status::kFull;
    items_[size_++] = item;
    return Status::kOk;
  }
  /// Precondition: not empty.
  constexpr void pop_back() {
    PLUMB_ASSERT(size_ > 0);
    --size_;
  }
  constexpr void clear() { size_ = 0; }
  /// Grows with value-initialised elements or shrinks. Precondition: n <= Capacity.
  constexpr void resize(std::size_t n) {
    PLUMB_ASSERT(n <= Capacity);
    for (std::size_t i = size_; i < n; ++i) items_[i] = T{};
    size_ = n;
  }
  /// Removes one element, keeping the order of the others. Precondition: i < size().
  constexpr void erase(std::size_t i) {
    PLUMB_ASSERT(i < size_);
    for (std::size_t k = i + 1; k < size_; ++k) items_[k - 1] = items_[k];
    --size_;
  }
  /// Removes every element for which the predicate holds, keeping the order of the others.
  template <typename Predicate>
  constexpr void erase_if(Predicate predicate) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < size_; ++i) {
      if (predicate(items_[i])) continue;
      if (kept != i) items_[kept] = items_[i];
      ++kept;
    }
    size_ = kept;
  }

 private:
  std::array<T, Capacity> items_{};
  std::size_t size_ = 0;
};

}  // namespace plumb
