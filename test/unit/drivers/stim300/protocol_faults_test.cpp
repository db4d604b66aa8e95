// What goes wrong on the line and in the unit is counted, and no wrong sample comes of it.

#include <gtest/gtest.h>

#include "test/support/property.h"
#include "test/unit/drivers/stim300/session.h"

namespace plumb::test {
namespace {

using stim300::Counters;
using stim300::State;

std::array<double, 3> turning(double t_s) { return {0.1 * t_s, 0.5, -0.3}; }

// No sample is off by more than noise, whatever happened.
void expect_right(const Stim300Session& session) {
  for (const ImuSample& sample : session.samples) {
    const std::array<double, 3> rate = turning(sample.t.seconds());
    for (std::size_t i = 0; i < 3; ++i) ASSERT_NEAR(sample.gyro_rad_s[i], rate[i], 1e-3);
    ASSERT_NEAR(sample.accel_m_s2[2], 9.80665, 1e-3);
  }
  for (std::size_t i = 1; i < session.samples.size(); ++i) ASSERT_GT(session.samples[i].t, session.samples[i - 1].t);
}

class ProtocolFaults : public ::testing::Test {
 protected:
  void SetUp() override {
    session.unit.set_rate(turning);
    session.start();
    before = session.protocol.counters();
    ASSERT_GT(before.samples, 20U);
  }
  void TearDown() override { expect_right(session); }
  const Counters& counters() const { return session.protocol.counters(); }
  emulator::Stim300Faults& faults() { return session.unit.faults(); }

  Stim300Session session;
  Counters before;
};

TEST_F(ProtocolFaults, DamagedBytes) {
  faults().flipped_bit = 0.003;
  faults().lost_byte = 0.003;
  faults().doubled_byte = 0.003;
  session.run_ms(20'000);
  const std::uint64_t became_nothing = 5000 - (counters().samples - before.samples);
  EXPECT_GT(counters().missing, 500U);
  EXPECT_LT(counters().missing, 2000U);  // one datagram for one hit, not more
  EXPECT_NEAR(static_cast<double>(became_nothing), static_cast<double>(counters().missing + counters().unaligned), 5.0);
  EXPECT_GT(session.protocol.framer().checksum_errors, 300U);
  EXPECT_GT(session.protocol.framer().skipped_bytes, 20U * 500U);
  EXPECT_EQ(session.protocol.clock().corrections(), 0U);
}

TEST_F(ProtocolFaults, AStuckUnit) {
  faults().stuck = true;
  session.run_ms(400);
  EXPECT_NEAR(static_cast<double>(counters().stuck), 100.0 - stim300::kMaxRepeats, 2.0);
  EXPECT_LE(counters().samples - before.samples, 10U);
  faults().stuck = false;
  session.samples.clear();  // the few that were taken before it was known
  session.run_ms(400);
  EXPECT_NEAR(static_cast<double>(session.samples.size()), 98.0, 3.0);
}

TEST_F(ProtocolFaults, StatusBits) {
  const auto run_with = [this](std::uint8_t status) {
    const Counters was = counters();
    faults().status = status;
    session.run_ms(200);
    faults().status = 0;
    session.run_ms(100);
    return was;
  };
  Counters was = run_with(0x40);
  EXPECT_NEAR(static_cast<double>(counters().starting - was.starting), 50.0, 1.0);
  was = run_with(0xFF);  // starting, whatever else is set
  EXPECT_EQ(counters().faulty, was.faulty);
  EXPECT_EQ(counters().starting.value, 0xFFFF) << "the status of both sensors";
  EXPECT_NEAR(static_cast<double>(counters().starting - was.starting), 50.0, 1.0);
  was = run_with(0x80);
  EXPECT_NEAR(static_cast<double>(counters().faulty - was.faulty), 50.0, 1.0);
  EXPECT_EQ(counters().faulty.value, 0x8080);
  was = run_with(0x09);
  EXPECT_NEAR(static_cast<double>(counters().faulty - was.faulty), 50.0, 1.0);
  was = run_with(0x14);
  EXPECT_NEAR(static_cast<double>(counters().overloads - was.overloads), 70.0, 1.0);
  EXPECT_NEAR(static_cast<double>(counters().samples - was.samples), 5.0, 2.0) << "calm for 80 ms of the 100";
  was = run_with(0x20);  // used all the same
  EXPECT_NEAR(static_cast<double>(counters().conditions - was.conditions), 50.0, 1.0);
  EXPECT_EQ(counters().conditions.value, 0x2020);
  EXPECT_NEAR(static_cast<double>(counters().samples - was.samples), 75.0, 2.0);
}

// Less than a shock: the samples at the limit are left out, those after them are used at once.
TEST_F(ProtocolFaults, AMomentAtTheLimit) {
  faults().status = 0x14;
  session.run_ms(8);
  faults().status = 0;
  session.run_ms(92);
  EXPECT_EQ(counters().overloads - before.overloads, 2U);
  EXPECT_NEAR(static_cast<double>(counters().samples - before.samples), 23.0, 2.0);
}

TEST_F(ProtocolFaults, AnUnpluggedLine) {
  faults().unplugged = true;
  session.run_ms(3000);
  EXPECT_EQ(counters().missing, 0U);
  faults().unplugged = false;
  session.run_ms(400);
  EXPECT_NEAR(static_cast<double>(counters().missing), 750.0, 1.0);
  EXPECT_EQ(counters().slips, 0U);
  EXPECT_NEAR(static_cast<double>(counters().samples - before.samples), 98.0, 3.0);
}

// Late by 4 ms for a while, as behind a busy host or a USB adapter: the stamps stay.
TEST_F(ProtocolFaults, LateBytes) {
  for (int i = 0; i < 20; ++i) {
    faults().late_ns = (i * 7 % 5) * kMs;
    session.run_ms(20);
  }
  EXPECT_EQ(counters().missing, 0U);
  EXPECT_EQ(counters().out_of_order, 0U);
  EXPECT_GT(counters().samples - before.samples, 90U);
}

TEST_F(ProtocolFaults, PowerLost) {
  session.unit.restart(session.t_ns + 50 * kMs);
  session.run_ms(50 + 100 + 281 + 200);
  EXPECT_EQ(counters().restarts, 2U);  // the first when it was switched on
  EXPECT_EQ(session.protocol.state(), State::kConfigured);
  EXPECT_NEAR(static_cast<double>(counters().starting - before.starting), 70.0, 2.0);
  EXPECT_NEAR(static_cast<double>(counters().samples - before.samples), 50.0, 3.0);
}

TEST_F(ProtocolFaults, AnotherSpeed) {
  emulator::Bytes noise;
  Generator g(base_seed());
  for (int i = 0; i < 100'000; ++i) noise.push_back(static_cast<std::uint8_t>(g.bits()));
  session.feed(noise, Time::from_ns(session.t_ns));
  EXPECT_EQ(counters().samples, before.samples);
  EXPECT_GT(session.protocol.framer().skipped_bytes, 99'000U);
  session.run_ms(400);
  EXPECT_NEAR(static_cast<double>(counters().samples - before.samples), 100.0, 3.0);
}

// A datagram that came twice is used once.
TEST_F(ProtocolFaults, ADatagramTwice) {
  const std::vector<emulator::Transmission> sent = session.unit.run_until(session.t_ns + 40 * kMs);
  session.t_ns += 40 * kMs;
  for (const emulator::Transmission& one : sent) {
    session.feed(one.bytes, Time::from_ns(one.t_end_ns));
    session.feed(one.bytes, Time::from_ns(one.t_end_ns));
  }
  EXPECT_EQ(counters().duplicates, sent.size());
  EXPECT_EQ(counters().samples - before.samples, sent.size());
}

// Everything 20 ms late for so long that the count is given up for it, then prompt again: the stamps come back to the
// truth at once, in order, and no datagram is taken for missing.
TEST(Stim300ProtocolClock, RecoversFromALongDelayInOrder) {
  Stim300Session session;
  session.unit.set_rate(turning);
  session.start();
  const auto late_s = [&session] {
    return session.samples.back().t.seconds() - session.samples.back().gyro_rad_s[0] / 0.1;
  };
  EXPECT_NEAR(late_s(), 0.0, 1e-4);
  session.unit.faults().late_ns = 20 * kMs;
  session.run_ms(600);
  EXPECT_EQ(session.protocol.clock().corrections(), 1U);
  EXPECT_NEAR(late_s(), 0.020, 1e-4);
  session.unit.faults().late_ns = 0;
  session.run_ms(100);
  EXPECT_NEAR(late_s(), 0.0, 1e-4);
  EXPECT_EQ(session.protocol.counters().missing, 0U);
  for (std::size_t i = 1; i < session.samples.size(); ++i) ASSERT_GT(session.samples[i].t, session.samples[i - 1].t);
}

// Any bytes at all, at any time: counted and survived.
TEST(Stim300ProtocolFuzz, SurvivesAnything) {
  for_all(200, [](Generator& g) {
    Stim300Session session({}, g.bits());
    session.start();
    const std::size_t good = session.samples.size();
    for (int i = 0; i < 50; ++i) {
      emulator::Bytes bytes(static_cast<std::size_t>(g.integer(0, 256)));
      for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(g.bits());
      session.feed(bytes, Time::from_ns(static_cast<std::int64_t>(g.bits())));
    }
    ASSERT_EQ(session.samples.size(), good);
  });
}

}  // namespace
}  // namespace plumb::test
