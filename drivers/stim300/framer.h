#pragma once
// Finds datagrams in a byte stream that may begin anywhere, come in any pieces, and hold anything.
//
// Right after a datagram the next one is expected, and nothing inside it is looked at: its payload may contain
// anything. Where that fails, each further byte may be the last of a datagram of any length, and the bytes of the
// failed one are searched in the same way. So every undamaged datagram is found, at the latest when as many bytes as
// one has have come after it, and a wrong one passes only with a checksum that fits by chance, once in 2^32 candidates.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/stim300/datagram.h"
#include "fsw/base/fault_counter.h"
#include "fsw/base/time.h"

namespace plumb::stim300 {

struct Frame {
  std::span<const std::uint8_t> bytes;  ///< a datagram whose checksum holds; valid until the next push()
  Time t_end;                           ///< arrival of its last byte
};

struct FramerCounters {
  std::uint64_t bytes = 0;
  std::uint64_t datagrams = 0;
  /// Began like the datagrams before, right where the last one ended, and failed. Value: the checksum that came and the
  /// one that is right, 32 bits each.
  FaultCounter checksum_errors;
  FaultCounter skipped_bytes;  ///< belonged to no datagram; CR LF after one is not counted. Value: the last of them
};

class Framer {
 public:
  /// One more byte and its arrival. Take out what it completes with next() before pushing another.
  void push(std::uint8_t byte, Time t);
  /// The next datagram. False: more bytes are needed.
  bool next(Frame& frame);
  /// There will be no more bytes for now (end of a recording, a line that fell silent): what is left is searched for
  /// datagrams by next(), which then gives up on the rest.
  void finish() { finishing_ = true; }

  const FramerCounters& counters() const { return counters_; }

 private:
  /// CR LF after a datagram may be on or off, and is not part of it.
  enum class LineEnd : std::uint8_t { kNone = 0, kMayCome, kCrSeen };

  // What waits is at most a datagram; twice that leaves room to move it to the front only now and then.
  static constexpr std::size_t kCapacity = 2 * (kMaxDatagramBytes + 1);

  bool step(Frame& frame);
  bool is_line_end(std::uint8_t byte);
  bool expecting() const;
  bool take(std::size_t size, Frame& frame);
  void on_wrong_checksum(std::size_t size);
  void skip(std::size_t count);
  void give_up_first();
  std::size_t window() const { return scan_ - begin_; }

  std::array<std::uint8_t, kCapacity> bytes_{};
  std::array<Time, kCapacity> arrivals_{};
  std::size_t begin_ = 0;  ///< first byte that no decision was taken about
  std::size_t scan_ = 0;   ///< one past the last byte looked at
  std::size_t end_ = 0;
  std::uint8_t identifier_ = 0;  ///< of the last normal datagram; 0: none yet
  bool aligned_ = false;         ///< begin_ is right behind a datagram
  LineEnd line_end_ = LineEnd::kNone;
  bool finishing_ = false;
  FramerCounters counters_;
};

}  // namespace plumb::stim300
