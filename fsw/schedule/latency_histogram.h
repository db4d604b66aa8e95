#pragma once
// How long something took, over a whole flight and in a fixed piece of memory: counts in buckets that grow with the
// time they stand for, 32 to the factor of two, so that a percentile is told to 3 %.

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "fsw/base/assert.h"
#include "fsw/base/time.h"

namespace plumb {

class LatencyHistogram {
 public:
  static constexpr int kFirstOctave = 10;
  static constexpr int kEndOctave = 34;
  /// Times below, about 1 us, are one bucket.
  static constexpr Duration kShortest = Duration::from_ns(std::int64_t{1} << kFirstOctave);
  /// Times from here on, about 17 s, are one bucket.
  static constexpr Duration kLongest = Duration::from_ns(std::int64_t{1} << kEndOctave);

  /// A time below zero, which only a clock that went back can give, counts as the shortest.
  void add(Duration time) {
    ++counts_[bucket_of(time)];
    ++count_;
    max_ = std::max(max_, time);
  }

  std::uint64_t count() const { return count_; }
  Duration max() const { return max_; }

  /// Upper end of the bucket that holds the time which so many thousandths of all times do not exceed (nearest rank),
  /// at most max(). Zero when there are none. Precondition: 1 to 1000.
  Duration permille(std::uint32_t share) const {
    PLUMB_ASSERT(share >= 1 && share <= 1000);
    const std::uint64_t rank = (count_ * share + 999) / 1000;
    std::uint64_t so_far = 0;
    for (std::size_t bucket = 0; bucket + 1 < kBuckets && count_ > 0; ++bucket) {
      so_far += counts_[bucket];
      if (so_far >= rank) return std::min(upper_end(bucket), max_);
    }
    return max_;
  }

  static constexpr std::size_t bucket_of(Duration time) {
    if (time < kShortest) return 0;
    if (time >= kLongest) return kBuckets - 1;
    const auto ns = static_cast<std::uint64_t>(time.ns());
    const int octave = static_cast<int>(std::bit_width(ns)) - 1;
    // The bits below the highest one, as many as tell the buckets of an octave apart.
    const std::uint64_t place = (ns >> (octave - kPlaceBits)) - kPlaces;
    return 1 + static_cast<std::size_t>(octave - kFirstOctave) * kPlaces + place;
  }

 private:
  static constexpr int kPlaceBits = 5;
  static constexpr std::size_t kPlaces = std::size_t{1} << kPlaceBits;
  static constexpr std::size_t kBuckets = 2 + static_cast<std::size_t>(kEndOctave - kFirstOctave) * kPlaces;

  /// The first time that is beyond a bucket. Precondition: not the last bucket.
  static constexpr Duration upper_end(std::size_t bucket) {
    const std::size_t octave = bucket / kPlaces;
    return Duration::from_ns(static_cast<std::int64_t>(kPlaces + bucket % kPlaces)
                             << (kFirstOctave - kPlaceBits + static_cast<int>(octave)));
  }

  std::array<std::uint64_t, kBuckets> counts_{};
  std::uint64_t count_ = 0;
  Duration max_;
};

}  // namespace plumb
