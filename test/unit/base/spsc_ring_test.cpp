#include "fsw/base/spsc_ring.h"

#include <gtest/gtest.h>

#include <atomic>
#include <deque>
#include <thread>

#include "test/support/property.h"

namespace plumb {
namespace {

TEST(SpscRing, StartsEmpty) {
  SpscRing<int, 4> ring;
  int out = 7;
  EXPECT_EQ(ring.capacity(), 4U);
  EXPECT_EQ(ring.size(), 0U);
  EXPECT_EQ(ring.front(), nullptr);
  EXPECT_FALSE(ring.pop(out));
  EXPECT_EQ(out, 7);
  EXPECT_EQ(ring.overflows(), 0U);
}

TEST(SpscRing, OneItem) {
  SpscRing<int, 4> ring;
  ASSERT_EQ(ring.push(5), Status::kOk);
  EXPECT_EQ(ring.size(), 1U);
  ASSERT_NE(ring.front(), nullptr);
  EXPECT_EQ(*ring.front(), 5);
  EXPECT_EQ(ring.size(), 1U) << "looking does not take";
  int out = 0;
  ASSERT_TRUE(ring.pop(out));
  EXPECT_EQ(out, 5);
  EXPECT_EQ(ring.size(), 0U);
}

TEST(SpscRing, ManyItemsInOrder) {
  SpscRing<int, 8> ring;
  for (int i = 0; i < 7; ++i) ASSERT_EQ(ring.push(i), Status::kOk);
  for (int i = 0; i < 7; ++i) {
    int out = -1;
    ASSERT_TRUE(ring.pop(out));
    EXPECT_EQ(out, i);
  }
}

TEST(SpscRing, AFullRingRefusesAndCounts) {
  SpscRing<int, 2> ring;
  ASSERT_EQ(ring.push(1), Status::kOk);
  ASSERT_EQ(ring.push(2), Status::kOk);
  EXPECT_EQ(ring.push(3), Status::kFull);
  EXPECT_EQ(ring.push(4), Status::kFull);
  EXPECT_EQ(ring.overflows(), 2U);
  EXPECT_EQ(ring.size(), 2U);
  int out = 0;
  ASSERT_TRUE(ring.pop(out));
  EXPECT_EQ(out, 1) << "what was in the ring stays as it was";
  EXPECT_EQ(ring.push(5), Status::kOk);
  ASSERT_TRUE(ring.pop(out));
  EXPECT_EQ(out, 2);
  ASSERT_TRUE(ring.pop(out));
  EXPECT_EQ(out, 5);
  EXPECT_EQ(ring.overflows(), 2U) << "the count stays";
}

TEST(SpscRing, WrapsAroundManyTimes) {
  SpscRing<std::uint64_t, 4> ring;
  std::uint64_t written = 0;
  std::uint64_t taken = 0;
  for (int round = 0; round < 1000; ++round) {
    for (int i = 0; i < 3; ++i) ASSERT_EQ(ring.push(written++), Status::kOk);
    for (int i = 0; i < 3; ++i) {
      std::uint64_t out = 0;
      ASSERT_TRUE(ring.pop(out));
      ASSERT_EQ(out, taken++);
    }
  }
}

TEST(SpscRing, NeighboursDoNotShareACacheLine) {
  static_assert(alignof(SpscRing<int, 2>) >= kCacheLineBytes);
  static_assert(sizeof(SpscRing<int, 2>) >= 3 * kCacheLineBytes);
}

TEST(SpscRing, AgreesWithAModel) {
  test::for_all(300, [](test::Generator& g) {
    SpscRing<std::uint64_t, 8> ring;
    std::deque<std::uint64_t> model;
    std::uint64_t refused = 0;
    for (int step = 0; step < 300; ++step) {
      if (g.integer(0, 1) == 0) {
        const std::uint64_t item = g.bits();
        const bool room = model.size() < ring.capacity();
        ASSERT_EQ(ring.push(item), room ? Status::kOk : Status::kFull);
        if (room) model.push_back(item);
        if (!room) ++refused;
      } else {
        std::uint64_t out = 0;
        ASSERT_EQ(ring.pop(out), !model.empty());
        if (model.empty()) continue;
        ASSERT_EQ(out, model.front());
        model.pop_front();
      }
      ASSERT_EQ(ring.size(), model.size());
      ASSERT_EQ(ring.overflows(), refused);
    }
  });
}

/// Large enough that a torn copy would show: every word is a function of the sequence number.
struct Item {
  std::uint64_t sequence = 0;
  std::uint64_t words[6] = {};

  static Item make(std::uint64_t sequence) {
    Item item;
    item.sequence = sequence;
    test::Generator g(sequence);
    for (std::uint64_t& word : item.words) word = g.bits();
    return item;
  }
  bool intact() const {
    test::Generator g(sequence);
    for (const std::uint64_t word : words) {
      if (word != g.bits()) return false;
    }
    return true;
  }
};

TEST(SpscRingStress, TwoThreadsLoseReorderAndTearNothing) {
  constexpr std::uint64_t kItems = 3'000'000;
  static SpscRing<Item, 64> ring;
  std::uint64_t refused = 0;
  std::thread producer([&refused] {
    for (std::uint64_t i = 0; i < kItems; ++i) {
      const Item item = Item::make(i);
      while (!ok(ring.push(item))) {
        ++refused;
        std::this_thread::yield();
      }
    }
  });
  std::uint64_t expected = 0;
  std::uint64_t wrong = 0;
  while (expected < kItems) {
    Item item;
    if (!ring.pop(item)) {
      std::this_thread::yield();
      continue;
    }
    if (item.sequence != expected || !item.intact()) ++wrong;
    ++expected;
  }
  producer.join();
  EXPECT_EQ(wrong, 0U);
  EXPECT_EQ(ring.size(), 0U);
  EXPECT_EQ(ring.overflows(), refused);
}

TEST(SpscRingStress, AProducerThatNeverWaitsLosesOnlyWhatIsCounted) {
  constexpr std::uint64_t kItems = 2'000'000;
  static SpscRing<Item, 16> ring;
  std::atomic<bool> finished{false};
  std::uint64_t refused = 0;
  std::thread producer([&] {
    for (std::uint64_t i = 0; i < kItems; ++i) {
      if (!ok(ring.push(Item::make(i)))) ++refused;
    }
    finished.store(true, std::memory_order_release);
  });
  std::uint64_t received = 0;
  std::uint64_t wrong = 0;
  std::uint64_t next_at_least = 0;
  for (;;) {
    const bool last_round = finished.load(std::memory_order_acquire);
    Item item;
    while (ring.pop(item)) {
      if (item.sequence < next_at_least || !item.intact()) ++wrong;
      next_at_least = item.sequence + 1;
      ++received;
    }
    if (last_round) break;
    std::this_thread::yield();
  }
  producer.join();
  EXPECT_EQ(wrong, 0U);
  EXPECT_EQ(received + ring.overflows(), kItems);
  EXPECT_EQ(ring.overflows(), refused);
}

}  // namespace
}  // namespace plumb
