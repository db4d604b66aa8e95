#pragma once
// The protocol at the other end of an emulated unit's line, with the time of both in the test's hands.

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "drivers/stim300/protocol.h"
#include "test/emulators/stim300/stim300_emulator.h"
#include "test/support/property.h"

namespace plumb::test {

inline constexpr std::int64_t kMs = 1'000'000;  // ns
inline constexpr std::int64_t kSwitchedOn_ns = 10'000 * kMs;

/// What a driver has to expect of a unit set up like this.
inline stim300::Settings settings_of(const emulator::Stim300Setup& setup) {
  constexpr std::array<int, 5> kFilters = {16, 33, 66, 131, 262};
  return {.rate_hz = setup.rate_hz(),
          .gyro_unit = static_cast<stim300::Unit>(setup.gyro_unit % 8),
          .gyro_delayed = setup.gyro_unit >= 8,
          .accel_unit = static_cast<stim300::Unit>(setup.accel_unit),
          .gyro_filter_hz = kFilters[static_cast<std::size_t>(setup.gyro_filter)],
          .accel_filter_hz = kFilters[static_cast<std::size_t>(setup.accel_filter)],
          .accel_range_g = setup.accel_range_g,
          .baud = setup.baud,
          .accelerometer = setup.accelerometer,
          .inclinometer = setup.inclinometer,
          .temperatures = setup.temperatures,
          .pps = setup.pps,
          .cr_lf = setup.cr_lf};
}

/// Any content, filter, range and rate, in one of the first `units` units; at the highest of the baud rates.
inline emulator::Stim300Setup any_setup(Generator& g, int units) {
  constexpr std::array<int, 4> kRanges = {5, 10, 30, 80};
  emulator::Stim300Setup setup;
  setup.baud = 1843200;
  setup.rate_code = static_cast<int>(g.integer(0, 4));
  setup.inclinometer = g.integer(0, 1) == 1;
  setup.temperatures = g.integer(0, 1) == 1;
  setup.pps = g.integer(0, 1) == 1;
  setup.cr_lf = g.integer(0, 1) == 1;
  setup.gyro_unit = static_cast<int>(g.integer(0, units - 1) + 8 * g.integer(0, 1));
  setup.accel_unit = static_cast<int>(g.integer(0, units - 1));
  setup.gyro_filter = static_cast<int>(g.integer(0, 4));
  setup.accel_filter = static_cast<int>(g.integer(0, 4));
  setup.accel_range_g = kRanges[static_cast<std::size_t>(g.integer(0, 3))];
  return setup;
}

class Stim300Session {
 public:
  explicit Stim300Session(const emulator::Stim300Setup& setup = {}, std::uint64_t seed = 1)
      : Stim300Session(setup, settings_of(setup), seed) {}
  Stim300Session(const emulator::Stim300Setup& setup, const stim300::Settings& expected, std::uint64_t seed = 1)
      : unit(setup, kSwitchedOn_ns, seed), protocol(expected) {}

  /// Runs both for a while, the host reading every millisecond.
  void run_ms(std::int64_t duration_ms) {
    for (std::int64_t i = 0; i < duration_ms; ++i) {
      t_ns += kMs;
      emulator::Bytes bytes;
      std::int64_t t_last_ns = t_ns - kMs;
      for (const emulator::Transmission& sent : unit.run_until(t_ns)) {
        bytes.insert(bytes.end(), sent.bytes.begin(), sent.bytes.end());
        t_last_ns = std::max(t_last_ns, sent.t_end_ns);
      }
      feed(bytes, Time::from_ns(t_last_ns));
    }
  }
  /// Until the unit's start-up is over.
  void start() { run_ms(500); }

  void feed(std::span<const std::uint8_t> bytes, Time t) {
    for (;;) {
      const std::size_t size = std::min(bytes.size(), stim300::kMaxChunkBytes);
      stim300::Samples chunk;
      protocol.feed(bytes.first(size), t, chunk);
      samples.insert(samples.end(), chunk.begin(), chunk.end());
      bytes = bytes.subspan(size);
      if (bytes.empty()) return;
    }
  }

  emulator::Stim300Emulator unit;
  stim300::Protocol protocol;
  std::vector<ImuSample> samples;
  std::int64_t t_ns = kSwitchedOn_ns;
};

}  // namespace plumb::test
