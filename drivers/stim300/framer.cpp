#include "drivers/stim300/framer.h"

#include <algorithm>

namespace plumb::stim300 {

void Framer::push(std::uint8_t byte, Time t) {
  PLUMB_ASSERT(scan_ == end_);
  if (end_ == kCapacity) {
    std::copy(bytes_.begin() + begin_, bytes_.begin() + end_, bytes_.begin());
    std::copy(arrivals_.begin() + begin_, arrivals_.begin() + end_, arrivals_.begin());
    end_ -= begin_;
    scan_ = end_;
    begin_ = 0;
  }
  PLUMB_ASSERT(end_ < kCapacity);
  bytes_[end_] = byte;
  arrivals_[end_] = t;
  ++end_;
  ++counters_.bytes;
  finishing_ = false;
}

bool Framer::next(Frame& frame) {
  // Each turn looks at one byte more or gives one up; what was given up is never looked at again.
  constexpr std::size_t kMaxTurns = kCapacity * kCapacity;
  for (std::size_t turn = 0; turn < kMaxTurns; ++turn) {
    if (scan_ < end_) {
      if (step(frame)) return true;
    } else if (finishing_ && begin_ < end_) {
      give_up_first();  // what began there will not be completed; something may have begun after it
    } else {
      return false;
    }
  }
  PLUMB_ASSERT(false && "the framer does not come to an end");
  return false;
}

bool Framer::step(Frame& frame) {
  ++scan_;
  if (is_line_end(bytes_[scan_ - 1])) return false;
  if (expecting()) {
    const std::size_t size = layout_of(identifier_).size;
    if (window() < size) return false;
    if (take(size, frame)) return true;
    on_wrong_checksum(size);
    give_up_first();
    return false;
  }
  const std::size_t longest = std::min(window(), kMaxDatagramBytes);
  for (std::size_t size = kMinDatagramBytes; size <= longest; ++size) {
    if (layout_of(bytes_[scan_ - size]).size == size && take(size, frame)) return true;
  }
  if (window() > kMaxDatagramBytes) {
    skip(1);
    aligned_ = false;
  }
  return false;
}

bool Framer::is_line_end(std::uint8_t byte) {
  const LineEnd state = line_end_;
  line_end_ = LineEnd::kNone;
  if (state == LineEnd::kMayCome && byte == '\r') {
    line_end_ = LineEnd::kCrSeen;
    return true;
  }
  if (state != LineEnd::kCrSeen || byte != '\n') return false;
  begin_ = scan_;
  return true;
}

bool Framer::expecting() const { return aligned_ && identifier_ != 0 && bytes_[begin_] == identifier_; }

// Whether the last `size` bytes looked at are a datagram; if so it is handed out, and what was before it skipped.
bool Framer::take(std::size_t size, Frame& frame) {
  const std::span<const std::uint8_t> candidate(bytes_.data() + scan_ - size, size);
  if (!checksum_holds(candidate)) return false;
  if (window() > size) skip(window() - size);
  ++counters_.datagrams;
  frame = {.bytes = candidate, .t_end = arrivals_[scan_ - 1]};
  if (layout_of(candidate[0]).kind == Kind::kNormal) identifier_ = candidate[0];
  begin_ = scan_;
  aligned_ = true;
  line_end_ = LineEnd::kMayCome;
  return true;
}

void Framer::on_wrong_checksum(std::size_t size) {
  const std::span<const std::uint8_t> failed(bytes_.data() + begin_, size);
  const std::uint32_t right = checksum(failed.first(size - kChecksumBytes));
  counters_.checksum_errors.add(value_pair(checksum_told(failed), right));
}

void Framer::skip(std::size_t count) {
  begin_ += count;
  counters_.skipped_bytes.add(bytes_[begin_ - 1], count);
}

void Framer::give_up_first() {
  skip(1);
  scan_ = begin_;  // what follows is looked at anew
  aligned_ = false;
  line_end_ = LineEnd::kNone;
}

}  // namespace plumb::stim300
