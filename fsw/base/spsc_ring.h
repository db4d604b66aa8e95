#pragma once
// The one way data passes between two threads: a bounded first-in first-out queue without locks, waiting or heap. One
// thread writes (the producer), one thread reads (the consumer); a device's I/O thread and the tick task, for instance.

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "fsw/base/assert.h"
#include "fsw/base/status.h"

namespace plumb {

/// Bytes that two cores may not write without disturbing each other: one line of the Cortex-A and x86-64 data caches.
inline constexpr std::size_t kCacheLineBytes = 64;

/// Every function is for the producer, for the consumer, or for anyone, and says which.
///
/// Overflow: a full ring refuses the new item and counts it. It never overwrites, because the oldest slot may be the
/// one the consumer is reading. What was taken before a gap is therefore complete and in order, and the count tells the
/// gap.
///
/// Why it is right. `written_` and `taken_` count items since construction and are never reduced modulo the capacity,
/// so full (difference = capacity) and empty (difference = 0) differ; they wrap at 2^64, which a power-of-two capacity
/// divides. Each has one writer, who may read it relaxed. Two pairs carry the data across:
///   1. push fills the slot, then stores `written_` with release; pop loads `written_` with acquire. Seeing the count
///      means seeing the slot's bytes.
///   2. pop copies the slot out, then stores `taken_` with release; push loads `taken_` with acquire. Seeing the slot
///      free means that the copy is finished, so the next item cannot tear it.
/// A count read late is only too small: the consumer sees fewer items than there are, the producer less room than there
/// is. Both are safe, and the next call sees more.
///
/// `Atomic` is std::atomic except in the test that steps through the interleavings.
template <typename T, std::size_t Capacity, template <typename> class Atomic = std::atomic>
class SpscRing {
  static_assert(std::is_trivially_copyable_v<T>, "items cross threads as plain bytes: T must be trivially copyable");
  static_assert(std::is_default_constructible_v<T>, "the slots exist before the items: T needs a default constructor");
  static_assert(Capacity >= 2 && (Capacity & (Capacity - 1)) == 0, "the capacity must be a power of two, at least 2");
  static_assert(std::atomic<std::uint64_t>::is_always_lock_free, "64-bit atomics must be lock-free on this machine");

 public:
  SpscRing() = default;
  SpscRing(const SpscRing&) = delete;
  SpscRing& operator=(const SpscRing&) = delete;

  static constexpr std::size_t capacity() { return Capacity; }

  /// Producer. kFull when there is no room: the item is dropped, and counted in overflows().
  Status push(const T& item) {
    const std::uint64_t written = written_.load(std::memory_order_relaxed);
    const std::uint64_t used = written - taken_.load(std::memory_order_acquire);
    PLUMB_ASSERT(used <= Capacity);
    if (used == Capacity) {
      overflows_.store(overflows_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
      return Status::kFull;
    }
    slots_[slot(written)] = item;
    written_.store(written + 1, std::memory_order_release);
    return Status::kOk;
  }

  /// Producer. Whether push() would be refused now.
  [[nodiscard]] bool full() const {
    return written_.load(std::memory_order_relaxed) - taken_.load(std::memory_order_acquire) == Capacity;
  }

  /// Consumer. Takes the oldest item; false, and `out` untouched, when there is none yet.
  [[nodiscard]] bool pop(T& out) {
    const T* oldest = front();
    if (oldest == nullptr) return false;
    out = *oldest;
    take();
    return true;
  }

  /// Consumer. Takes the oldest item without a copy, once front() has been looked at. Precondition: there is one.
  void drop() {
    PLUMB_ASSERT(size() > 0);
    take();
  }

  /// Consumer. The oldest item where it lies, or null when there is none yet. Valid until the next pop() or drop().
  [[nodiscard]] const T* front() const {
    if (size() == 0) return nullptr;
    return &slots_[slot(taken_.load(std::memory_order_relaxed))];
  }

  /// Consumer. Items ready to be taken; the producer may be adding more.
  [[nodiscard]] std::size_t size() const {
    const std::uint64_t used = written_.load(std::memory_order_acquire) - taken_.load(std::memory_order_relaxed);
    PLUMB_ASSERT(used <= Capacity);
    return static_cast<std::size_t>(used);
  }

  /// Anyone. Items refused since construction.
  [[nodiscard]] std::uint64_t overflows() const { return overflows_.load(std::memory_order_relaxed); }

 private:
  void take() { taken_.store(taken_.load(std::memory_order_relaxed) + 1, std::memory_order_release); }
  static constexpr std::size_t slot(std::uint64_t count) { return static_cast<std::size_t>(count) & (Capacity - 1); }

  // The producer's line, the consumer's line and the slots lie apart, so that neither thread's counting takes the line
  // away from the other.
  alignas(kCacheLineBytes) Atomic<std::uint64_t> written_{0};
  Atomic<std::uint64_t> overflows_{0};
  alignas(kCacheLineBytes) Atomic<std::uint64_t> taken_{0};
  alignas(kCacheLineBytes) std::array<T, Capacity> slots_{};
};

}  // namespace plumb
