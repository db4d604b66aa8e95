#include "fsw/base/fixed_vector.h"

#include <gtest/gtest.h>

#include <numeric>
#include <vector>

#include "test/support/property.h"

namespace plumb {
namespace {

template <std::size_t Capacity>
FixedVector<int, Capacity> count_to(int n) {
  FixedVector<int, Capacity> v;
  for (int i = 1; i <= n; ++i) EXPECT_EQ(v.push_back(i), Status::kOk);
  return v;
}

template <std::size_t Capacity>
std::vector<int> contents(const FixedVector<int, Capacity>& v) {
  return {v.begin(), v.end()};
}

TEST(FixedVector, StartsEmpty) {
  const FixedVector<int, 3> v;
  EXPECT_TRUE(v.empty());
  EXPECT_FALSE(v.full());
  EXPECT_EQ(v.size(), 0U);
  EXPECT_EQ(v.capacity(), 3U);
  EXPECT_EQ(v.begin(), v.end());
}

TEST(FixedVector, FillsToItsCapacityAndRefusesMore) {
  auto v = count_to<3>(3);
  EXPECT_TRUE(v.full());
  EXPECT_EQ(v.push_back(4), Status::kFull);
  EXPECT_EQ(contents(v), (std::vector<int>{1, 2, 3}));
  EXPECT_EQ(v.front(), 1);
  EXPECT_EQ(v.back(), 3);
}

TEST(FixedVector, CapacityOfOne) {
  auto v = count_to<1>(1);
  EXPECT_EQ(&v.front(), &v.back());
  v.pop_back();
  EXPECT_TRUE(v.empty());
  EXPECT_EQ(v.push_back(9), Status::kOk);
  EXPECT_EQ(v[0], 9);
}

TEST(FixedVector, ElementsAreWritableInPlace) {
  auto v = count_to<4>(3);
  v[1] = 20;
  v.front() = 10;
  v.back() = 30;
  EXPECT_EQ(contents(v), (std::vector<int>{10, 20, 30}));
  EXPECT_EQ(v.data(), v.begin());
}

TEST(FixedVector, ResizeClearsWhatItAdds) {
  auto v = count_to<4>(3);
  v.resize(1);
  EXPECT_EQ(contents(v), (std::vector<int>{1}));
  v.resize(4);
  EXPECT_EQ(contents(v), (std::vector<int>{1, 0, 0, 0}));
  v.resize(0);
  EXPECT_TRUE(v.empty());
}

TEST(FixedVector, EraseKeepsTheOrder) {
  auto v = count_to<5>(5);
  v.erase(0);
  v.erase(3);
  v.erase(1);
  EXPECT_EQ(contents(v), (std::vector<int>{2, 4}));
}

TEST(FixedVector, EraseIfKeepsTheOrder) {
  auto v = count_to<8>(8);
  v.erase_if([](int x) { return x % 3 == 0; });
  EXPECT_EQ(contents(v), (std::vector<int>{1, 2, 4, 5, 7, 8}));
  v.erase_if([](int) { return false; });
  EXPECT_EQ(v.size(), 6U);
  v.erase_if([](int) { return true; });
  EXPECT_TRUE(v.empty());
}

TEST(FixedVector, CopiesAreIndependent) {
  auto a = count_to<4>(2);
  auto b = a;
  b.clear();
  EXPECT_EQ(a.size(), 2U);
}

TEST(FixedVector, WorksAtCompileTime) {
  constexpr int kSum = [] {
    FixedVector<int, 4> v;
    v.resize(3);
    std::iota(v.begin(), v.end(), 1);
    v.erase(1);
    return v[0] + v[1];
  }();
  static_assert(kSum == 4);
}

TEST(FixedVector, AgreesWithAModel) {
  test::for_all(500, [](test::Generator& g) {
    constexpr std::size_t kCapacity = 6;
    FixedVector<int, kCapacity> v;
    std::vector<int> model;
    for (int step = 0; step < 60; ++step) {
      const int value = static_cast<int>(g.integer(0, 9));
      switch (g.integer(0, 4)) {
        case 0:
        case 1:
          EXPECT_EQ(ok(v.push_back(value)), model.size() < kCapacity);
          if (model.size() < kCapacity) model.push_back(value);
          break;
        case 2:
          if (model.empty()) break;
          v.pop_back();
          model.pop_back();
          break;
        case 3: {
          if (model.empty()) break;
          const std::int64_t i = g.integer(0, static_cast<std::int64_t>(model.size()) - 1);
          v.erase(static_cast<std::size_t>(i));
          model.erase(model.begin() + i);
          break;
        }
        default: v.erase_if([value](int x) { return x == value; }); std::erase(model, value);
      }
      ASSERT_EQ(contents(v), model);
    }
  });
}

TEST(FixedVectorDeathTest, AccessOutsideIsABug) {
  auto v = count_to<4>(2);
  EXPECT_DEATH(v[2] = 0, "");
  v.clear();
  EXPECT_DEATH((void)v.front(), "");
  EXPECT_DEATH((void)v.back(), "");
  EXPECT_DEATH(v.pop_back(), "");
  EXPECT_DEATH(v.erase(0), "");
  EXPECT_DEATH(v.resize(5), "");
}

}  // namespace
}  // namespace plumb
