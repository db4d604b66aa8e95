#include "drivers/stim300/protocol.h"

#include <gtest/gtest.h>

#include "test/support/property.h"
#include "test/unit/drivers/stim300/session.h"
#include "test/unit/drivers/stim300/stream.h"

namespace plumb::test {
namespace {

using emulator::Stim300Setup;
using stim300::Counters;
using stim300::State;

constexpr int kUsableUnits = 3;  // not integrated

// Slow enough that a linear interpolation over 8 ms is off by less than the tolerances below.
std::array<double, 3> rate_at(double t_s) { return {0.4 * std::sin(3.0 * t_s), -0.3 * std::cos(2.0 * t_s), 0.2}; }
std::array<double, 3> force_at(double t_s) {
  return {3.0 * std::sin(2.0 * t_s), -2.0 * std::cos(3.0 * t_s), 9.80665 + std::sin(t_s)};
}

// The law of the whole chain: a sample tells the motion at its own stamp, for every unit, filter, rate and content.
TEST(Stim300Protocol, SamplesTellTheMotionAtTheirStamp) {
  for_all(60, [](Generator& g) {
    const Stim300Setup setup = any_setup(g, kUsableUnits);
    Stim300Session session(setup, g.bits());
    session.unit.set_rate(rate_at);
    session.unit.set_specific_force(force_at);
    session.run_ms(1000);
    const Counters& counters = session.protocol.counters();
    ASSERT_EQ(session.protocol.state(), State::kConfigured);
    ASSERT_EQ(counters.samples, session.samples.size());
    // Numbers have 2^16 counts per g at worst; increments at 2 kHz, 2^19 per m/s.
    const double gyro_tolerance = 5e-5 + 2.0 * stim300::gyro_scale_rad_s(settings_of(setup));
    const double accel_tolerance = 5e-4 + 2.0 * stim300::accel_scale_m_s2(settings_of(setup));
    for (const ImuSample& sample : session.samples) {
      const std::array<double, 3> rate = rate_at(sample.t.seconds());
      const std::array<double, 3> force = force_at(sample.t.seconds());
      for (std::size_t i = 0; i < 3; ++i) {
        ASSERT_NEAR(sample.gyro_rad_s[i], rate[i], gyro_tolerance) << i;
        ASSERT_NEAR(sample.accel_m_s2[i], force[i], accel_tolerance) << i;
      }
    }
    // All datagrams after the start-up became samples, but for those that filled the memory of the faster sensor.
    ASSERT_EQ(counters.missing + counters.slips + counters.duplicates + counters.faulty + counters.out_of_order, 0U);
    ASSERT_LE(counters.unaligned, 55U);
    const auto sent = static_cast<double>(setup.rate_hz()) * (1.0 - 0.1 - 0.281);
    ASSERT_NEAR(static_cast<double>(counters.samples + counters.unaligned), sent, 3.0);
    for (std::size_t i = 1; i < session.samples.size(); ++i) {
      const double dt = (session.samples[i].t - session.samples[i - 1].t).seconds();
      ASSERT_NEAR(dt, 1.0 / setup.rate_hz(), 1e-6);
    }
  });
}

// However a stream is cut into reads, the same samples come out. A read that spans a pause of the line, which the
// system returns only to a host that was late, stamps what was before the pause too late; so the stamps are compared
// for the cuts that a prompt host sees, and for any other that no datagram is lost or made up.
TEST(Stim300Protocol, AnyChunkingGivesTheSameSamples) {
  for_all(40, [](Generator& g) {
    const Stim300Setup setup = any_setup(g, kUsableUnits);
    emulator::Stim300Emulator unit(setup, kSwitchedOn_ns, g.bits());
    unit.set_rate(rate_at);
    unit.set_specific_force(force_at);
    const std::vector<emulator::Transmission> stream = unit.run_until(kSwitchedOn_ns + 800 * kMs);
    const std::int64_t per_byte_ns = 10'000'000'000 / setup.baud;
    const auto decode = [&](std::int64_t longest) {
      Stim300Session session(setup);
      for (const emulator::Transmission& sent : stream) {
        for (std::size_t at = 0; at < sent.bytes.size();) {
          const std::size_t size = std::min(static_cast<std::size_t>(g.integer(1, longest)), sent.bytes.size() - at);
          const auto after = static_cast<std::int64_t>(sent.bytes.size() - at - size);
          session.feed(std::span(sent.bytes).subspan(at, size), Time::from_ns(sent.t_end_ns - after * per_byte_ns));
          at += size;
        }
      }
      return session.samples;
    };
    const std::vector<ImuSample> bytewise = decode(1);
    const std::vector<ImuSample> chunked = decode(80);
    ASSERT_GT(bytewise.size(), 20U);
    ASSERT_EQ(chunked.size(), bytewise.size());
    for (std::size_t i = 0; i < chunked.size(); ++i) {
      ASSERT_NEAR((chunked[i].t - bytewise[i].t).seconds(), 0.0, 1e-6) << i;
      for (std::size_t k = 0; k < 3; ++k) {
        ASSERT_NEAR(chunked[i].gyro_rad_s[k], bytewise[i].gyro_rad_s[k], 1e-6);
        ASSERT_NEAR(chunked[i].accel_m_s2[k], bytewise[i].accel_m_s2[k], 1e-5);
      }
    }

    Bytes all;
    for (const emulator::Transmission& sent : stream) all.insert(all.end(), sent.bytes.begin(), sent.bytes.end());
    Stim300Session late(setup);
    for (std::size_t at = 0; at < all.size();) {
      const std::size_t size = std::min(static_cast<std::size_t>(g.integer(1, 256)), all.size() - at);
      const double progress = static_cast<double>(at + size) / static_cast<double>(all.size());
      late.feed(std::span(all).subspan(at, size), Time::from_ns(kSwitchedOn_ns + std::llround(progress * 800.0 * kMs)));
      at += size;
    }
    ASSERT_EQ(late.protocol.framer().datagrams, stream.size());
    ASSERT_EQ(late.protocol.framer().skipped_bytes, 0U);
    ASSERT_EQ(late.protocol.counters().missing + late.protocol.counters().duplicates, 0U);
  });
}

TEST(Stim300Protocol, NothingIsASampleBeforeTheConfigurationIsKnown) {
  Stim300Session session;
  Bytes special;
  for (const emulator::Transmission& sent : session.unit.run_until(kSwitchedOn_ns + 102 * kMs)) {
    special.insert(special.end(), sent.bytes.begin(), sent.bytes.end());  // not passed on
  }
  session.t_ns += 102 * kMs;
  session.run_ms(500);
  EXPECT_EQ(session.protocol.state(), State::kUnconfigured);
  EXPECT_TRUE(session.samples.empty());
  EXPECT_GT(session.protocol.counters().unconfigured, 100U);
  const std::array<std::uint8_t, 2> tell = {'C', '\r'};
  session.unit.receive(tell, session.t_ns);
  session.run_ms(100);
  EXPECT_EQ(session.protocol.state(), State::kConfigured);
  EXPECT_NEAR(static_cast<double>(session.samples.size()), 23.0, 2.0);
}

TEST(Stim300Protocol, RefusesAUnitThatIsSetUpOtherwise) {
  const Stim300Setup actual = {.gyro_unit = 0, .accel_range_g = 30};
  Stim300Session session(actual, settings_of({}));
  session.run_ms(600);
  EXPECT_EQ(session.protocol.state(), State::kRefused);
  EXPECT_TRUE(session.samples.empty());
  const stim300::Differences& differences = session.protocol.differences();
  ASSERT_EQ(differences.size(), 3U);  // unit, delay and range
  EXPECT_STREQ(differences[2].name, "accelerometer range in g");
  EXPECT_EQ(differences[2].expected, 10);
  EXPECT_EQ(differences[2].actual, 30);
  // A unit that is set right meanwhile is taken.
  const Bytes right = emulator::encode_configuration({});
  session.feed(right, Time::from_ns(session.t_ns));
  EXPECT_EQ(session.protocol.state(), State::kConfigured);
}

TEST(Stim300Protocol, FurtherContentIsNoReasonToRefuse) {
  const Stim300Setup actual = {.inclinometer = true, .temperatures = true, .cr_lf = true};
  Stim300Session session(actual, settings_of({}));
  session.run_ms(600);
  EXPECT_EQ(session.protocol.state(), State::kConfigured);
  EXPECT_GT(session.samples.size(), 40U);
}

// A real unit, from power-on: its start-up, and not one datagram lost after it.
TEST(Stim300Protocol, UnderstandsARealUnit) {
  const std::optional<Bytes> capture = Capture::read();
  if (!capture) GTEST_SKIP() << kNoData;
  const Stim300Setup setup = {
      .rate_code = 4, .inclinometer = true, .cr_lf = true, .gyro_unit = 0, .accel_unit = 0, .accel_range_g = 30};
  Stim300Session session(setup);
  session.feed(emulator::encode_configuration(setup), Time::from_ns(0));
  for (std::size_t at = 0; at < capture->size(); at += Capture::kPitch) {
    const std::size_t size = std::min(Capture::kPitch, capture->size() - at);
    session.feed(std::span(*capture).subspan(at, size),
                 Time::from_ns(1'000'000 + static_cast<std::int64_t>(at / 40) * 500'000));
  }
  const Counters& counters = session.protocol.counters();
  EXPECT_EQ(session.protocol.framer().checksum_errors, 0U);
  EXPECT_EQ(session.protocol.framer().datagrams, Capture::kDatagrams + 1);
  EXPECT_EQ(counters.starting, 562U);
  EXPECT_EQ(counters.missing + counters.slips + counters.duplicates + counters.faulty + counters.stuck, 0U);
  EXPECT_EQ(counters.samples + counters.unaligned, Capture::kDatagrams - 562);
  EXPECT_LE(counters.unaligned, 9U);  // 4 ms at 2 kHz
  EXPECT_EQ(counters.out_of_order, 0U);
}

}  // namespace
}  // namespace plumb::test
