#include "drivers/stim300/framer.h"

#include <gtest/gtest.h>

#include "test/emulators/stim300/stim300_encoder.h"
#include "test/support/property.h"
#include "test/unit/drivers/stim300/stream.h"

namespace plumb::test {
namespace {

using emulator::Stim300Content;
using emulator::Stim300Setup;
using stim300::Framer;
using stim300::FramerCounters;

void append(Bytes& to, const Bytes& what) { to.insert(to.end(), what.begin(), what.end()); }

Stim300Setup any_setup(Generator& g) {
  return {.accelerometer = g.integer(0, 3) != 0,
          .inclinometer = g.integer(0, 1) == 1,
          .temperatures = g.integer(0, 1) == 1,
          .pps = g.integer(0, 1) == 1,
          .aux = g.integer(0, 1) == 1,
          .cr_lf = g.integer(0, 1) == 1};
}

// Payloads are full of identifiers and line ends, the worst there can be.
Stim300Content any_content(Generator& g) {
  constexpr std::array<std::uint8_t, 8> kTraps = {0x90, 0x91, 0x93, 0xF7, 0xBC, 0x0D, 0x0A, 0xA5};
  const auto trap = [&] { return kTraps[static_cast<std::size_t>(g.integer(0, 7))]; };
  const auto counts = [&] { return trap() << 16 | trap() << 8 | trap(); };
  Stim300Content content;
  for (std::int32_t& count : content.gyro) count = counts();
  for (std::int32_t& count : content.accel) count = counts();
  for (std::int32_t& count : content.inclinometer) count = counts();
  content.gyro_status = trap();
  content.counter = trap();
  return content;
}

Bytes garbage(Generator& g, std::int64_t longest) {
  Bytes bytes(static_cast<std::size_t>(g.integer(1, longest)));
  for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(g.bits());
  return bytes;
}

TEST(Stim300Framer, FindsSpecialDatagramsBetweenNormalOnes) {
  const Bytes normal = emulator::encode_normal({}, {});
  Bytes stream;
  append(stream, emulator::encode_part_number({}));
  append(stream, emulator::encode_serial_number({}));
  append(stream, emulator::encode_configuration({}));
  append(stream, normal);
  append(stream, emulator::encode_configuration({}));
  append(stream, normal);
  Framer framer;
  EXPECT_EQ(find_datagrams(stream, framer, false).size(), 6U);
  EXPECT_EQ(framer.counters().skipped_bytes, 0U);
  EXPECT_EQ(framer.counters().checksum_errors, 0U);
}

TEST(Stim300Framer, StampsADatagramWithItsLastByte) {
  Framer framer;
  const Bytes bytes = from_hex(kA);
  stim300::Frame frame;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    EXPECT_FALSE(framer.next(frame));
    framer.push(bytes[i], Time::from_ns(static_cast<std::int64_t>(1000 + i)));
  }
  ASSERT_TRUE(framer.next(frame));
  EXPECT_EQ(frame.t_end, Time::from_ns(1000 + 27));
}

TEST(Stim300Framer, CountsAFailedDatagramOnce) {
  Bytes stream = from_hex(kA);
  append(stream, from_hex(kABad));
  append(stream, from_hex(kA));
  Framer framer;
  EXPECT_EQ(find_datagrams(stream, framer, false).size(), 2U);
  EXPECT_EQ(framer.counters().checksum_errors, 1U);
  EXPECT_EQ(framer.counters().skipped_bytes, 28U);
}

// Whatever byte of a datagram is wrong but the first, which tells what it is.
TEST(Stim300Framer, TellsTheChecksumThatCameAndTheRightOneAndTheLastByteSkipped) {
  const Bytes good = from_hex(kA);
  for (std::size_t i = 1; i < good.size(); ++i) {
    Bytes bad = good;
    bad[i] ^= 0x5A;
    Bytes stream = good;
    append(stream, bad);
    append(stream, good);
    Framer framer;
    EXPECT_EQ(find_datagrams(stream, framer, false).size(), 2U);
    const std::span<const std::uint8_t> covered = std::span(bad).first(bad.size() - stim300::kChecksumBytes);
    std::uint64_t told = 0;
    for (const std::uint8_t byte : std::span(bad).last(stim300::kChecksumBytes)) told = told << 8U | byte;
    EXPECT_EQ(static_cast<std::uint64_t>(framer.counters().checksum_errors.value),
              told << 32U | stim300::checksum(covered));
    EXPECT_EQ(framer.counters().skipped_bytes.value, bad.back());
  }
}

// Line ends count as garbage where no datagram was before them, or when they are half.
TEST(Stim300Framer, PassesOverOneLineEndAfterADatagram) {
  const Bytes a = from_hex(kA);
  const auto skipped = [&a](const Bytes& between) {
    Bytes stream = a;
    append(stream, between);
    append(stream, a);
    Framer framer;
    EXPECT_EQ(find_datagrams(stream, framer, false).size(), 2U);
    return framer.counters().skipped_bytes;
  };
  EXPECT_EQ(skipped({}), 0U);
  EXPECT_EQ(skipped({'\r', '\n'}), 0U);
  EXPECT_EQ(skipped({'\r'}), 1U);
  EXPECT_EQ(skipped({'\n'}), 1U);
  EXPECT_EQ(skipped({'\n', '\r'}), 2U);
  EXPECT_EQ(skipped({'\r', '\n', '\r', '\n'}), 2U);
}

// Any setup, any payload, any garbage before: the first datagram after it is found by its last byte, unless garbage
// that looked like the beginning of one held it back, and then with the next.
TEST(Stim300Framer, ResynchronisesWithinTwoDatagrams) {
  for_all(400, [](Generator& g) {
    const Stim300Setup setup = any_setup(g);
    const std::int64_t before = g.integer(0, 2);
    Bytes stream;
    for (int i = 0; i < before; ++i) append(stream, emulator::encode_normal(setup, any_content(g)));
    append(stream, garbage(g, 200));
    const std::size_t clean = stream.size();
    std::vector<Bytes> sent;
    for (int i = 0; i < 4; ++i) {
      sent.push_back(emulator::encode_normal(setup, any_content(g)));
      append(stream, sent.back());
    }
    Framer framer;
    const std::vector<Found> found = find_datagrams(stream, framer);
    ASSERT_EQ(found.size(), static_cast<std::size_t>(before) + sent.size());
    const std::size_t pitch = sent.front().size();
    for (std::size_t i = 0; i < sent.size(); ++i) {
      const Found& f = found[static_cast<std::size_t>(before) + i];
      ASSERT_TRUE(std::equal(f.bytes.begin(), f.bytes.end(), sent[i].begin()));
      ASSERT_LE(f.after, clean + (i + 2) * pitch);
    }
  });
}

// Lost and doubled bytes.
TEST(Stim300Framer, LosesOnlyTheDatagramThatWasDamaged) {
  for_all(400, [](Generator& g) {
    const Stim300Setup setup = any_setup(g);
    const std::size_t hit = static_cast<std::size_t>(g.integer(0, 4));
    std::vector<Bytes> sent;
    Bytes stream;
    for (std::size_t i = 0; i < 5; ++i) {
      sent.push_back(emulator::encode_normal(setup, any_content(g)));
      Bytes wire = sent.back();
      if (setup.cr_lf) sent.back().resize(wire.size() - 2);
      if (i == hit) {
        const auto at = wire.begin() + g.integer(0, static_cast<std::int64_t>(sent.back().size()) - 2);
        if (g.integer(0, 1) == 0 || *at == *(at + 1)) {
          wire.erase(at);
        } else {
          wire.insert(at + 1, *at);
        }
      }
      append(stream, wire);
    }
    sent.erase(sent.begin() + static_cast<std::ptrdiff_t>(hit));
    std::vector<Bytes> found;
    for (const Found& f : find_datagrams(stream)) found.push_back(f.bytes);
    // A byte lost to its equal beside it, or doubled at the end, leaves the datagram whole.
    for (const Bytes& datagram : sent) ASSERT_NE(std::find(found.begin(), found.end(), datagram), found.end());
    ASSERT_LE(found.size(), sent.size() + 1);
  });
}

// Every byte of a stream is in a datagram, in a line end, or counted as skipped.
TEST(Stim300Framer, AccountsForEveryByte) {
  for_all(400, [](Generator& g) {
    Bytes stream;
    for (int i = 0; i < 6; ++i) {
      Stim300Setup setup = any_setup(g);
      setup.cr_lf = false;
      if (g.integer(0, 1) == 0) append(stream, garbage(g, 90));
      append(stream, emulator::encode_normal(setup, any_content(g)));
      if (g.integer(0, 4) == 0) stream.resize(stream.size() - static_cast<std::size_t>(g.integer(1, 17)));
    }
    Framer framer;
    std::size_t in_datagrams = 0;
    for (const Found& f : find_datagrams(stream, framer)) in_datagrams += f.bytes.size();
    const FramerCounters& counters = framer.counters();
    const std::size_t accounted = in_datagrams + counters.skipped_bytes;
    ASSERT_LE(accounted, stream.size());
    ASSERT_GE(accounted + 2 * counters.datagrams, stream.size());  // garbage may begin with CR LF
    ASSERT_EQ(counters.bytes, stream.size());
  });
}

}  // namespace
}  // namespace plumb::test
