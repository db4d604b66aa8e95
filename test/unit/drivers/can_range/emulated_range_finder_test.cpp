// The driver beside the emulated range finder, whatever goes wrong with it.

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <vector>

#include "drivers/can_range/decoder.h"
#include "test/emulators/can_range/can_range_emulator.h"
#include "test/support/property.h"

namespace plumb::can_range {
namespace {

using Kind = test::CanRangeEmulator::Kind;

constexpr std::int64_t kStart_ns = 5'000'000'000;
constexpr std::int64_t kStep_ns = test::CanRangeEmulator::kPeriod_ns;

Options options_for(Kind kind) {
  return {.protocol = kind == Kind::kDronecan ? Protocol::kDronecan : Protocol::kBenewake,
          .latency = Duration::from_ns(test::CanRangeEmulator::kLatency_ns)};
}

/// Another distance at every time, in steps that every kind tells exactly: 1/16 m from 16 m, in whole centimetres.
double distance_m(std::int64_t t_ns) { return 16.0 + 0.25 * static_cast<double>((t_ns - kStart_ns) / kStep_ns % 64); }

std::vector<RangeSample> run_until(test::CanRangeEmulator& unit, Decoder& decoder, std::int64_t t_ns) {
  std::vector<RangeSample> samples;
  for (const test::CanTransmission& sent : unit.run_until(t_ns)) {
    const Result<Reading> reading = decoder.decode({.t = Time::from_ns(sent.t_end_ns), .frame = sent.frame});
    if (reading) samples.push_back(reading->sample);
  }
  return samples;
}

// Frames lost, doubled and, where a checksum covers them, with wrong bits: what becomes a sample was measured, when its
// stamp says, once; and without faults nothing is missing.
TEST(EmulatedCanRange, EverySampleIsAMeasurementStampedWhenItWasMade) {
  test::for_all(150, [](test::Generator& g) {
    const auto kind = static_cast<Kind>(g.integer(0, 2));
    test::CanRangeEmulator unit(kind, kStart_ns, g.bits());
    unit.set_motion([](std::int64_t t_ns) { return std::optional(distance_m(t_ns)); });
    Decoder decoder(options_for(kind));
    unit.faults() = {.lost_frame = g.uniform(0.0, 0.3)};
    if (kind == Kind::kDronecan) {
      unit.faults().flipped_bit = g.uniform(0.0, 0.1);
      unit.faults().doubled_frame = g.uniform(0.0, 0.3);
    }
    std::int64_t t_ns = kStart_ns + 50 * kStep_ns;
    Time last = Time::never();
    for (const RangeSample& sample : run_until(unit, decoder, t_ns)) {
      // A doubled first frame moves those behind it, not the measurement, which is stamped by the one that begins anew.
      const std::int64_t error_ns = (sample.t.ns() - kStart_ns) % kStep_ns;
      ASSERT_LE(error_ns, 131'000 * (unit.faults().doubled_frame > 0.0 ? 1 : 0));
      ASSERT_EQ(sample.range_m, distance_m(sample.t.ns() - error_ns));
      ASSERT_GT(sample.t, last);
      last = sample.t;
    }
    unit.faults() = {};
    static_cast<void>(run_until(unit, decoder, t_ns += kStep_ns));  // what was begun with faults
    const std::vector<RangeSample> sound = run_until(unit, decoder, t_ns + 40 * kStep_ns);
    ASSERT_EQ(sound.size(), 40U);
    for (const RangeSample& sample : sound) ASSERT_EQ(sample.range_m, distance_m(sample.t.ns()));
  });
}

TEST(EmulatedCanRange, FaultsOfTheUnit) {
  for (const Kind kind : {Kind::kDronecan, Kind::kTf03, Kind::kTfminiI}) {
    SCOPED_TRACE(static_cast<int>(kind));
    test::CanRangeEmulator unit(kind, kStart_ns, 1);
    unit.set_motion([](std::int64_t t_ns) { return std::optional(distance_m(t_ns)); });
    Decoder decoder(options_for(kind));
    std::int64_t t_ns = kStart_ns + kStep_ns / 2;
    const auto next = [&] { return run_until(unit, decoder, t_ns += 10 * kStep_ns); };
    static_cast<void>(next());
    unit.faults().stuck = true;
    std::vector<RangeSample> samples = next();
    ASSERT_EQ(samples.size(), 10U);
    for (const RangeSample& sample : samples) EXPECT_EQ(sample.range_m, samples[0].range_m);
    unit.faults() = {.silent = true};
    EXPECT_TRUE(next().empty());
    unit.faults() = {.late_ns = 3 * kStep_ns / 4};
    samples = next();
    ASSERT_GE(samples.size(), 9U);
    for (const RangeSample& sample : samples) {
      EXPECT_EQ(sample.range_m, distance_m(sample.t.ns() - 3 * kStep_ns / 4)) << "told later than it was";
    }
    unit.faults() = {};
    static_cast<void>(next());
    for (const std::optional<double> far : {std::optional<double>(), std::optional(200.0)}) {
      unit.set_range_m(far);
      for (const RangeSample& sample : next()) EXPECT_EQ(sample.quality, RangeQuality::kNoReturn);
    }
  }
}

TEST(EmulatedCanRange, ANodeThatSaysNotANumberMeasuresNothing) {
  test::CanRangeEmulator unit(Kind::kDronecan, kStart_ns, 1);
  unit.set_range_m(12.5);
  unit.faults().not_a_number = true;
  Decoder decoder({});
  EXPECT_TRUE(run_until(unit, decoder, kStart_ns + 10 * kStep_ns).empty());
  EXPECT_EQ(decoder.counters().malformed, 10U);
}

}  // namespace
}  // namespace plumb::can_range
