// The driver against the emulated device, on a clock that only transfers and waiting move.

#include "drivers/lidar_lite/device.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "test/emulators/lidar_lite/lidar_lite_bus.h"
#include "test/support/property.h"

namespace plumb::lidar_lite {
namespace {

using test::LidarLiteBus;
using test::LidarLiteEmulator;
using Kind = LidarLiteEmulator::Kind;

struct Pair {
  Model model;
  Kind kind;
  double reach_m;
};
constexpr Pair kPairs[] = {
    {Model::kV3, Kind::kV3, 40.0}, {Model::kV3Hp, Kind::kV3Hp, 40.0}, {Model::kV4Led, Kind::kV4Led, 10.0}};

// From a device that is well again to the next sample: the longest pause before a reset, the rest of an acquisition
// that does not end, the reset, and set-up with a measurement.
constexpr Duration kRecovery = kMaxBackOffPause + kMaxAcquisition + kResetPause + Duration::from_ms(60);

struct Bench {
  explicit Bench(const Pair& pair, Options options = {})
      : emulator(pair.kind), bus(emulator), device(bus, with(options, pair)) {}
  static Options with(Options options, const Pair& pair) {
    options.model = pair.model;
    return options;
  }

  std::vector<RangeSample> run_for(Duration duration) {
    std::vector<RangeSample> samples;
    const Time end = bus.now() + duration;
    while (bus.now() < end) {
      const Result<RangeSample> sample = device.poll(bus.now());
      if (sample) samples.push_back(*sample);
      bus.wait_until(std::min(device.wake(), end));
    }
    return samples;
  }

  LidarLiteEmulator emulator;
  LidarLiteBus bus;
  Device device;
};

class LidarLiteDevice : public testing::TestWithParam<Pair> {};
INSTANTIATE_TEST_SUITE_P(EveryModel, LidarLiteDevice, testing::ValuesIn(kPairs), [](const auto& tested) {
  return std::string(tested.param.model == Model::kV3 ? "V3" : tested.param.model == Model::kV3Hp ? "V3Hp" : "V4Led");
});

TEST_P(LidarLiteDevice, Measures25TimesASecondAndBreaksNoRuleOfTheBus) {
  Bench bench(GetParam());
  bench.emulator.set_range_m(7.654);
  const std::vector<RangeSample> samples = bench.run_for(Duration::from_ms(4000));
  EXPECT_GE(samples.size(), 97U);
  for (const RangeSample& sample : samples) {
    EXPECT_EQ(sample.quality, RangeQuality::kValid);
    EXPECT_NEAR(sample.range_m, 7.654, 0.005001);
  }
  EXPECT_EQ(bench.emulator.violations(), std::vector<std::string>());
  const std::vector<std::int64_t>& commands = bench.emulator.command_times_ns();
  for (std::size_t i = 1; i < commands.size(); ++i) {
    EXPECT_NEAR(static_cast<double>(commands[i] - commands[i - 1]), 40e6, 0.5e6);
  }
  EXPECT_NEAR(static_cast<double>(commands.back() - commands.front()), 40e6 * static_cast<double>(commands.size() - 1),
              1e6)
      << "the rate does not drift";
  EXPECT_EQ(bench.device.counters().resets, 1U);
  EXPECT_EQ(bench.device.counters().late, 0U);
  EXPECT_EQ(bench.device.counters().ranges, samples.size());
}

// A target that moves at v is where the sample says it is at the sample's time, whatever the acquisition takes.
TEST_P(LidarLiteDevice, StampsTheMiddleOfTheAcquisition) {
  test::for_all(30, [](test::Generator& g) {
    Bench bench(GetParam());
    const double speed_m_s = g.uniform(-0.9, 0.9);
    const auto range_at = [speed_m_s](std::int64_t t_ns) { return 5.0 + speed_m_s * static_cast<double>(t_ns) * 1e-9; };
    bench.emulator.set_motion(range_at);
    bench.emulator.world.acquisition_ns = g.integer(500'000, 30'000'000);
    const std::vector<RangeSample> samples = bench.run_for(Duration::from_ms(2000));
    ASSERT_GE(samples.size(), 30U);
    // The end of busy is seen up to a poll and two transfers late, and counts half.
    constexpr double kLatest_s = 0.5 * (1.5e-3 + 0.2e-3);
    for (const RangeSample& sample : samples) {
      ASSERT_NEAR(sample.range_m, range_at(sample.t.ns()), 0.005001 + std::abs(speed_m_s) * kLatest_s);
    }
  });
}

TEST_P(LidarLiteDevice, TheWholeReachToHalfACentimetre) {
  test::for_all(200, [](test::Generator& g) {
    Bench bench(GetParam());
    const double range_m = g.uniform(0.05, GetParam().reach_m);
    bench.emulator.set_range_m(range_m);
    const std::vector<RangeSample> samples = bench.run_for(Duration::from_ms(200));
    ASSERT_FALSE(samples.empty());
    ASSERT_EQ(samples.back().quality, RangeQuality::kValid);
    ASSERT_NEAR(samples.back().range_m, range_m, 0.005001);
  });
}

TEST_P(LidarLiteDevice, WithoutATargetThereIsNoRange) {
  Bench bench(GetParam());
  bench.emulator.set_range_m(std::nullopt);
  for (const bool one : {false, true}) {
    bench.emulator.world.no_return_cm = one ? 1 : 0;
    const std::vector<RangeSample> samples = bench.run_for(Duration::from_ms(3000));
    EXPECT_GE(samples.size(), 40U);
    for (const RangeSample& sample : samples) EXPECT_EQ(sample.quality, RangeQuality::kNoReturn);
  }
}

TEST_P(LidarLiteDevice, OneCentimetreIsNeverARange) {
  Bench bench(GetParam());
  bench.emulator.world.spoil_every = 3;
  for (const RangeSample& sample : bench.run_for(Duration::from_ms(2000))) {
    if (sample.quality == RangeQuality::kValid) {
      EXPECT_DOUBLE_EQ(sample.range_m, 10.0);
    }
  }
  EXPECT_GE(bench.device.counters().no_returns, 14U);
}

TEST_P(LidarLiteDevice, CorrectsTheBiasOftenEnough) {
  for (const int period : {1, 7, 100}) {
    Bench bench(GetParam(), {.bias_period = period});
    EXPECT_FALSE(bench.run_for(Duration::from_ms(10'000)).empty());
    if (GetParam().kind == Kind::kV3Hp) {
      EXPECT_EQ(bench.emulator.longest_without_bias(), 0) << "it corrects by itself";
    } else {
      EXPECT_EQ(bench.emulator.longest_without_bias(), period - 1);
    }
  }
}

TEST_P(LidarLiteDevice, ADeviceThatRefusesWhileBusyIsNotAtFault) {
  Bench bench(GetParam());
  bench.emulator.world.refuses_while_busy = true;
  EXPECT_GE(bench.run_for(Duration::from_ms(2000)).size(), 47U);
  EXPECT_GT(bench.device.counters().not_acknowledged, 100U);
  EXPECT_EQ(bench.device.counters().resets, 1U);
}

TEST_P(LidarLiteDevice, ASlowAcquisitionLeavesPeriodsOut) {
  Bench bench(GetParam());
  bench.emulator.world.acquisition_ns = 60'000'000;
  EXPECT_GE(bench.run_for(Duration::from_ms(2000)).size(), 29U);
  EXPECT_GT(bench.device.counters().late, 0U);
  EXPECT_EQ(bench.device.counters().resets, 1U);
}

// Something goes wrong for a while; the counter that names it moves; and soon after it is over there are ranges again.
struct Fault {
  const char* name;
  std::function<void(LidarLiteEmulator::World&, bool)> set;
  std::function<std::uint32_t(const Counters&)> counter;
};
const Fault kFaults[] = {
    {"dead", [](auto& world, bool on) { world.dead = on; }, [](const Counters& c) { return c.not_acknowledged; }},
    {"stuck busy", [](auto& world, bool on) { world.stuck_busy = on; },
     [](const Counters& c) { return c.busy_timeouts; }},
    {"stuck at zero", [](auto& world, bool on) { world.stuck_zero = on; }, [](const Counters& c) { return c.stuck; }},
    {"not ready", [](auto& world, bool on) { world.not_ready = on; }, [](const Counters& c) { return c.not_ready; }},
};

TEST_P(LidarLiteDevice, ComesBackAfterEveryFault) {
  for (const Fault& fault : kFaults) {
    SCOPED_TRACE(fault.name);
    test::for_all(5, [&fault](test::Generator& g) {
      Bench bench(GetParam());
      ASSERT_FALSE(bench.run_for(Duration::from_ns(g.integer(200'000'000, 400'000'000))).empty());
      const std::uint32_t before = fault.counter(bench.device.counters());
      fault.set(bench.emulator.world, true);
      bench.run_for(Duration::from_ns(g.integer(1'200'000'000, 6'000'000'000)));
      EXPECT_GT(fault.counter(bench.device.counters()), before);
      fault.set(bench.emulator.world, false);
      const std::vector<RangeSample> samples = bench.run_for(kRecovery);
      EXPECT_GE(bench.device.counters().resets, 2U);
      ASSERT_FALSE(samples.empty());
      EXPECT_EQ(samples.back().quality, RangeQuality::kValid);
    });
  }
}

TEST_P(LidarLiteDevice, BacksOffFromADeviceThatKeepsFailing) {
  Bench bench(GetParam());
  bench.emulator.world.stuck_busy = true;
  bench.run_for(Duration::from_ms(10'000));
  // 0, 50, 100, 200, 400 ms, then 800 ms before each, and 150 ms for the reset and the acquisition that does not end.
  EXPECT_GE(bench.device.counters().resets, 13U);
  EXPECT_LE(bench.device.counters().resets, 15U);
}

// Of the v3 and v3HP the register that is read back has the preset's value after a reset.
TEST(LidarLiteDeviceModels, APresetThatDoesNotStickIsNotMeasuredWith) {
  Bench bench(kPairs[2]);
  bench.emulator.world.forgets_writes = true;
  EXPECT_TRUE(bench.run_for(Duration::from_ms(2000)).empty());
  const FaultCounter& failures = bench.device.counters().verify_failures;
  EXPECT_GT(failures, 0U);
  EXPECT_NE(failures.value, table_of(kPairs[2].model).preset.front().value);
  EXPECT_EQ(bench.emulator.measurements(), 0);
  bench.emulator.world.forgets_writes = false;
  EXPECT_FALSE(bench.run_for(kRecovery).empty());
}

// The v4 LED tells no signal strength.
TEST(LidarLiteDeviceModels, SayWhenTheSignalIsWeak) {
  for (const Pair& pair : {kPairs[0], kPairs[1]}) {
    Bench bench(pair);
    bench.emulator.world.strength = 20;
    for (const RangeSample& sample : bench.run_for(Duration::from_ms(500))) {
      EXPECT_EQ(sample.quality, RangeQuality::kWeak);
    }
    EXPECT_GT(bench.device.counters().weak, 5U);
  }
}

TEST(LidarLiteDeviceModels, AnotherModelAtTheAddressIsNotMeasuredWith) {
  for (const Pair& wanted : kPairs) {
    for (const Pair& there : kPairs) {
      if (wanted.kind == there.kind) continue;
      Bench bench({wanted.model, there.kind, 0.0});
      EXPECT_TRUE(bench.run_for(Duration::from_ms(3000)).empty());
      const Counters& counters = bench.device.counters();
      EXPECT_GT(counters.wrong_model + counters.verify_failures, 3U);
      if (counters.wrong_model > 0) {
        EXPECT_FALSE(table_of(wanted.model).is_identity(static_cast<std::uint8_t>(counters.wrong_model.value)));
      }
      EXPECT_EQ(bench.emulator.measurements(), 0);
    }
  }
}

TEST(LidarLiteDevicePoll, EndsAtTheFirstTransferThatFails) {
  Bench bench(kPairs[0]);
  bench.emulator.world.dead = true;
  for (int i = 0; i < 50; ++i) {
    const std::uint32_t before = bench.device.counters().not_acknowledged;
    (void)bench.device.poll(bench.bus.now());
    EXPECT_LE(bench.device.counters().not_acknowledged - before, 1U);
    bench.bus.wait_until(bench.device.wake());
  }
}

}  // namespace
}  // namespace plumb::lidar_lite
