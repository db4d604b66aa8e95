// The framer on the bytes of a real unit.

#include <gtest/gtest.h>

#include <algorithm>

#include "test/support/property.h"
#include "test/unit/drivers/stim300/stream.h"

namespace plumb::test {
namespace {

using stim300::Framer;

class FramerOnCapture : public ::testing::Test {
 protected:
  void SetUp() override {
    const std::optional<Bytes> capture = Capture::read();
    if (!capture) GTEST_SKIP() << kNoData;
    capture_ = *capture;
    ASSERT_EQ(capture_.size(), Capture::kDatagrams * Capture::kPitch + 28);
  }
  Bytes capture_;
};

TEST_F(FramerOnCapture, FindsEveryDatagram) {
  Framer framer;
  const std::vector<Found> found = find_datagrams(capture_, framer);
  ASSERT_EQ(found.size(), Capture::kDatagrams);
  for (std::size_t i = 0; i < found.size(); ++i) {
    ASSERT_EQ(found[i].bytes, Capture::datagram(capture_, i)) << i;
    ASSERT_EQ(found[i].after, i * Capture::kPitch + Capture::kSize) << i;
  }
  EXPECT_EQ(framer.counters().checksum_errors, 0U);
  EXPECT_EQ(framer.counters().skipped_bytes, 28U);
  EXPECT_EQ(framer.counters().bytes, capture_.size());
}

// A stream that begins or ends at any byte of the capture, and has a few datagrams before or after: every whole
// datagram in it is found, and nothing else.
TEST_F(FramerOnCapture, CutAtEveryByteOffset) {
  constexpr std::size_t kLength = 3;  // datagrams
  const auto at = [this](std::size_t byte) { return capture_.begin() + static_cast<std::ptrdiff_t>(byte); };
  for (std::size_t datagram = 0; datagram + kLength <= Capture::kDatagrams; ++datagram) {
    const std::size_t from = datagram * Capture::kPitch;
    const std::size_t to = from + kLength * Capture::kPitch;
    for (std::size_t cut = 0; cut < Capture::kPitch; ++cut) {
      const std::vector<Found> tail = find_datagrams({at(from + cut), at(to)});
      const std::size_t first = cut == 0 ? 0 : 1;
      ASSERT_EQ(tail.size(), kLength - first) << datagram << " " << cut;
      for (std::size_t i = 0; i < tail.size(); ++i) {
        ASSERT_EQ(tail[i].bytes, Capture::datagram(capture_, datagram + first + i));
        // At once: at its last byte.
        ASSERT_EQ(tail[i].after, (first + i) * Capture::kPitch + Capture::kSize - cut);
      }
      const std::vector<Found> head = find_datagrams({at(from), at(to - cut)});
      ASSERT_EQ(head.size(), kLength - (cut <= Capture::kPitch - Capture::kSize ? 0 : 1)) << datagram << " " << cut;
    }
  }
}

// 1 % of the bytes flipped: all undamaged datagrams are found, none else, and each within two datagrams of its end.
TEST_F(FramerOnCapture, OnePercentOfTheBytesFlipped) {
  for_all(5, [this](Generator& g) {
    Bytes damaged = capture_;
    std::vector<bool> is_damaged(Capture::kDatagrams + 1);
    for (std::size_t i = 0; i < damaged.size(); ++i) {
      if (g.integer(0, 99) != 0) continue;
      damaged[i] ^= static_cast<std::uint8_t>(g.integer(1, 255));
      if (i % Capture::kPitch < Capture::kSize) is_damaged[i / Capture::kPitch] = true;
    }
    Framer framer;
    const std::vector<Found> found = find_datagrams(damaged, framer);
    std::size_t next = 0;
    for (std::size_t i = 0; i < Capture::kDatagrams; ++i) {
      if (is_damaged[i]) continue;
      ASSERT_LT(next, found.size());
      ASSERT_EQ(found[next].bytes, Capture::datagram(capture_, i)) << i;
      ASSERT_LE(found[next].after, i * Capture::kPitch + Capture::kSize + 2 * Capture::kPitch) << i;
      ++next;
    }
    ASSERT_EQ(next, found.size()) << "datagrams that were never sent";
    const auto lost = static_cast<std::size_t>(std::count(is_damaged.begin(), is_damaged.end(), true));
    EXPECT_GT(lost, Capture::kDatagrams / 4);
    EXPECT_LE(framer.counters().checksum_errors, lost);
    EXPECT_GT(framer.counters().checksum_errors, lost / 2);  // those before which the stream was whole
  });
}

}  // namespace
}  // namespace plumb::test
