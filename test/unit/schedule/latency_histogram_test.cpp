// The histogram against all of its times in order.

#include "fsw/schedule/latency_histogram.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace plumb {
namespace {

// Over all that the buckets stand for, and beyond on both sides.
TEST(LatencyHistogram, TellsAPercentileToItsBucketAndNeverTooShort) {
  std::mt19937_64 dice(1);
  std::uniform_real_distribution<double> exponent(2.0, 11.0);
  for (const int count : {1, 2, 999, 1000, 1001, 20'000}) {
    LatencyHistogram histogram;
    std::vector<std::int64_t> all;
    for (int i = 0; i < count; ++i) {
      all.push_back(static_cast<std::int64_t>(std::pow(10.0, exponent(dice))));
      histogram.add(Duration::from_ns(all.back()));
    }
    std::sort(all.begin(), all.end());
    EXPECT_EQ(histogram.count(), all.size());
    EXPECT_EQ(histogram.max().ns(), all.back());
    for (const std::uint32_t share : {1U, 250U, 500U, 990U, 999U, 1000U}) {
      const std::size_t rank = (all.size() * share + 999) / 1000;
      const std::int64_t exact = all[rank - 1];
      const std::int64_t told = histogram.permille(share).ns();
      EXPECT_GE(told, exact) << share << " of " << count;
      if (exact < LatencyHistogram::kLongest.ns()) {
        EXPECT_LE(told, std::max(LatencyHistogram::kShortest.ns(), exact + exact / 32 + 1)) << share << " of " << count;
      } else {
        EXPECT_EQ(told, all.back());
      }
    }
  }
}

TEST(LatencyHistogram, BucketsAreInOrderWithoutAHole) {
  std::size_t bucket = LatencyHistogram::bucket_of(Duration());
  for (std::int64_t ns = 1; ns < LatencyHistogram::kLongest.ns(); ns += 1 + ns / 100) {
    const std::size_t next = LatencyHistogram::bucket_of(Duration::from_ns(ns));
    ASSERT_TRUE(next == bucket || next == bucket + 1) << ns;
    bucket = next;
  }
  EXPECT_EQ(LatencyHistogram::bucket_of(LatencyHistogram::kLongest), bucket + 1);
  EXPECT_EQ(LatencyHistogram::bucket_of(Duration::max()), bucket + 1);
  EXPECT_EQ(LatencyHistogram::bucket_of(Duration::min()), std::size_t{0});
}

TEST(LatencyHistogram, WithoutTimesTellsZero) { EXPECT_EQ(LatencyHistogram().permille(999), Duration()); }

}  // namespace
}  // namespace plumb
