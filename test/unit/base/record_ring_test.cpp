#include "fsw/base/record_ring.h"

#include <gtest/gtest.h>

#include <array>
#include <thread>
#include <vector>

#include "test/support/property.h"

namespace plumb {
namespace {

constexpr const char* kChannel = "CHANNEL";

std::vector<std::uint8_t> record_of(std::size_t size, std::uint64_t number) {
  std::vector<std::uint8_t> bytes(size);
  for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::uint8_t>(number * 31 + i);
  return bytes;
}

// Whatever is pushed and popped in whatever order: what was taken in comes out whole and in order, and the rest is
// counted.
TEST(RecordRing, GivesBackWhatItTookAndCountsWhatItDidNot) {
  test::for_all(200, [](test::Generator& g) {
    std::array<std::uint8_t, 256> storage{};
    RecordRing ring(storage);
    std::array<std::uint8_t, 256> room{};
    std::vector<std::uint64_t> inside;
    std::vector<std::size_t> sizes;
    std::uint64_t refused = 0;
    for (std::uint64_t number = 0; number < 300; ++number) {
      if (g.integer(0, 1) == 0) {
        const auto size = static_cast<std::size_t>(g.integer(0, 100));
        const Status pushed =
            ring.push(kChannel, Time::from_ns(static_cast<std::int64_t>(number)), record_of(size, number));
        if (ok(pushed)) {
          inside.push_back(number);
          sizes.push_back(size);
        } else {
          EXPECT_EQ(pushed, Status::kFull);
          ++refused;
        }
        continue;
      }
      RecordRing::Record record;
      const bool popped = ring.pop(ring.written(), room, record);
      ASSERT_EQ(popped, !inside.empty());
      if (!popped) continue;
      EXPECT_EQ(record.channel, kChannel);
      EXPECT_EQ(record.t.ns(), static_cast<std::int64_t>(inside.front()));
      EXPECT_EQ(std::vector<std::uint8_t>(record.bytes.begin(), record.bytes.end()),
                record_of(sizes.front(), inside.front()));
      inside.erase(inside.begin());
      sizes.erase(sizes.begin());
    }
    EXPECT_EQ(ring.dropped(), refused);
  });
}

TEST(RecordRing, StopsAtTheEndThatWasSeen) {
  std::array<std::uint8_t, 256> storage{};
  RecordRing ring(storage);
  ASSERT_EQ(ring.push(kChannel, Time(), record_of(3, 1)), Status::kOk);
  const std::uint64_t end = ring.written();
  ASSERT_EQ(ring.push(kChannel, Time(), record_of(3, 2)), Status::kOk);
  std::array<std::uint8_t, 16> room{};
  RecordRing::Record record;
  EXPECT_TRUE(ring.pop(end, room, record));
  EXPECT_FALSE(ring.pop(end, room, record));
}

TEST(RecordRing, RefusesARecordThatCouldNeverFit) {
  std::array<std::uint8_t, 64> storage{};
  RecordRing ring(storage);
  EXPECT_EQ(ring.push(kChannel, Time(), record_of(65, 1)), Status::kFull);
  EXPECT_EQ(ring.dropped(), 1U);
}

TEST(RecordRing, CarriesRecordsFromThreadToThread) {
  std::vector<std::uint8_t> storage(4096);
  RecordRing ring(storage);
  constexpr std::uint64_t kRecords = 20000;
  std::thread producer([&ring] {
    for (std::uint64_t number = 0; number < kRecords; ++number) {
      while (
          !ok(ring.push(kChannel, Time::from_ns(static_cast<std::int64_t>(number)), record_of(number % 200, number)))) {
        std::this_thread::yield();
      }
    }
  });
  std::array<std::uint8_t, 256> room{};
  std::uint64_t wrong = 0;
  for (std::uint64_t number = 0; number < kRecords;) {
    RecordRing::Record record;
    if (!ring.pop(ring.written(), room, record)) {
      std::this_thread::yield();
      continue;
    }
    const std::vector<std::uint8_t> expected = record_of(number % 200, number);
    if (!std::equal(expected.begin(), expected.end(), record.bytes.begin(), record.bytes.end())) ++wrong;
    ++number;
  }
  producer.join();
  EXPECT_EQ(wrong, 0U);
}

}  // namespace
}  // namespace plumb
