#pragma once
// A queue of records of any size between two threads, without locks, waiting or heap: SpscRing's discipline for bytes.
// It carries what is to be logged from a flight thread to the one that may wait for a disk.

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include "fsw/base/assert.h"
#include "fsw/base/spsc_ring.h"
#include "fsw/base/status.h"
#include "fsw/base/time.h"

namespace plumb {

class RecordRing {
 public:
  struct Record {
    const char* channel = nullptr;
    Time t;
    std::span<const std::uint8_t> bytes;
  };

  /// `storage` must outlive the ring; its size is a power of two.
  explicit RecordRing(std::span<std::uint8_t> storage) : storage_(storage) {
    PLUMB_ASSERT(storage.size() > sizeof(Header) && (storage.size() & (storage.size() - 1)) == 0);
  }
  RecordRing(const RecordRing&) = delete;
  RecordRing& operator=(const RecordRing&) = delete;

  /// Producer. `channel` must outlive the record. kFull when there is no room: the record is dropped and counted.
  Status push(const char* channel, Time t, std::span<const std::uint8_t> bytes) {
    const Header header{.channel = channel, .t = t, .size = bytes.size()};
    const std::uint64_t written = written_.load(std::memory_order_relaxed);
    const std::uint64_t used = written - taken_.load(std::memory_order_acquire);
    if (bytes.size() > storage_.size() || used + sizeof header + bytes.size() > storage_.size()) {
      dropped_.store(dropped_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
      return Status::kFull;
    }
    copy_in(written, &header, sizeof header);
    copy_in(written + sizeof header, bytes.data(), bytes.size());
    written_.store(written + sizeof header + bytes.size(), std::memory_order_release);
    return Status::kOk;
  }

  /// Consumer. How far the producer has come: what pop() may be called up to.
  std::uint64_t written() const { return written_.load(std::memory_order_acquire); }
  /// Consumer. Takes the oldest record, if it was written before `end`, which written() has returned. Its bytes are
  /// copied to the beginning of `room`; precondition: it has room for the largest record that is pushed.
  bool pop(std::uint64_t end, std::span<std::uint8_t> room, Record& record) {
    const std::uint64_t taken = taken_.load(std::memory_order_relaxed);
    if (taken == end) return false;
    Header header;
    copy_out(taken, &header, sizeof header);
    PLUMB_ASSERT(header.size <= room.size());
    copy_out(taken + sizeof header, room.data(), header.size);
    record = {.channel = header.channel, .t = header.t, .bytes = room.first(header.size)};
    taken_.store(taken + sizeof header + header.size, std::memory_order_release);
    return true;
  }

  /// Anyone. Records refused since construction.
  std::uint64_t dropped() const { return dropped_.load(std::memory_order_relaxed); }

 private:
  struct Header {
    const char* channel = nullptr;
    Time t;
    std::size_t size = 0;
  };

  // A record may run over the end of the storage to its beginning: two pieces.
  void copy_in(std::uint64_t at, const void* from, std::size_t size) {
    const std::size_t place = at & (storage_.size() - 1);
    const std::size_t first = std::min(size, storage_.size() - place);
    if (first > 0) std::memcpy(storage_.data() + place, from, first);
    if (size > first) std::memcpy(storage_.data(), static_cast<const std::uint8_t*>(from) + first, size - first);
  }
  void copy_out(std::uint64_t at, void* to, std::size_t size) const {
    const std::size_t place = at & (storage_.size() - 1);
    const std::size_t first = std::min(size, storage_.size() - place);
    if (first > 0) std::memcpy(to, storage_.data() + place, first);
    if (size > first) std::memcpy(static_cast<std::uint8_t*>(to) + first, storage_.data(), size - first);
  }

  std::span<std::uint8_t> storage_;
  alignas(kCacheLineBytes) std::atomic<std::uint64_t> written_{0};  ///< bytes since construction
  std::atomic<std::uint64_t> dropped_{0};
  alignas(kCacheLineBytes) std::atomic<std::uint64_t> taken_{0};
};

}  // namespace plumb
