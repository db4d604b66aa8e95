#include "fsw/base/hash.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>
#include <vector>

#include "test/support/property.h"

namespace plumb {
namespace {

std::uint64_t hash_of(const std::vector<double>& values) {
  Hash64 hash;
  hash.add(values.data(), values.size());
  return hash.value();
}

std::vector<double> any_values(test::Generator& g, std::size_t count) {
  std::vector<double> values(count);
  for (double& value : values) value = g.normal(10.0);
  return values;
}

TEST(Hash64, EqualBitsGiveEqualHashes) {
  test::for_all(100, [](test::Generator& g) {
    const std::vector<double> values = any_values(g, 50);
    EXPECT_EQ(hash_of(values), hash_of(values));
    Hash64 one_by_one;
    for (const double value : values) one_by_one.add(value);
    EXPECT_EQ(one_by_one.value(), hash_of(values));
  });
}

// The replay compares states by their hashes, so no bit may go by unnoticed, wherever it stands.
TEST(Hash64, EveryBitOfEveryNumberCounts) {
  test::Generator g(test::base_seed());
  const std::vector<double> values = any_values(g, 40);
  std::set<std::uint64_t> seen = {hash_of(values)};
  for (std::size_t i = 0; i < values.size(); ++i) {
    for (int bit = 0; bit < 64; ++bit) {
      std::vector<double> other = values;
      other[i] = std::bit_cast<double>(std::bit_cast<std::uint64_t>(other[i]) ^ (std::uint64_t{1} << bit));
      EXPECT_TRUE(seen.insert(hash_of(other)).second) << "number " << i << ", bit " << bit;
    }
  }
}

TEST(Hash64, OrderAndLengthCount) {
  EXPECT_NE(hash_of({1.0, 2.0}), hash_of({2.0, 1.0}));
  EXPECT_NE(hash_of({0.0}), hash_of({0.0, 0.0}));
  EXPECT_NE(hash_of({}), hash_of({0.0}));
}

TEST(Hash64, ItIsTheBitsThatCountAndNotTheValue) {
  EXPECT_NE(hash_of({0.0}), hash_of({-0.0}));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(hash_of({nan}), hash_of({nan}));
  EXPECT_NE(hash_of({nan}), hash_of({-nan}));
}

// Half of the bits change when one does, or hashes of hashes (the hash of a whole run) would lose differences.
TEST(Hash64, OneBitChangesHalfOfThem) {
  double changed = 0.0;
  constexpr int kCases = 2000;
  test::for_all(kCases, [&changed](test::Generator& g) {
    const std::uint64_t word = g.bits();
    Hash64 a;
    Hash64 b;
    a.add(word);
    b.add(word ^ (std::uint64_t{1} << g.integer(0, 63)));
    a.add(std::uint64_t{0});
    b.add(std::uint64_t{0});
    changed += std::popcount(a.value() ^ b.value());
  });
  EXPECT_NEAR(changed / kCases, 32.0, 3.0);
}

}  // namespace
}  // namespace plumb
