// The driver on a real serial line of the system, a pseudo-terminal, with an emulated unit at the other end.

#include "drivers/stim300/device.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "hal/linux/monotonic_clock.h"
#include "hal/linux/serial_port.h"
#include "test/emulators/stim300/stim300_on_pty.h"
#include "test/unit/drivers/stim300/session.h"

namespace plumb::test {
namespace {

using emulator::Stim300OnPty;
using emulator::Stim300Setup;
using stim300::Device;
using stim300::State;

std::array<double, 3> rate_at(double t_s) { return {0.4 * std::sin(3.0 * t_s), -0.3, 0.2}; }

class Stim300Device : public ::testing::Test {
 protected:
  void open(std::uint32_t baud = 921600) {
    std::string error;
    port_ = LinuxSerialPort::open(unit_.device(), {.baud = baud}, error);
    ASSERT_NE(port_, nullptr) << error;
    device_ = std::make_unique<Device>(*port_, settings_of({.baud = baud}));
  }
  /// Polls for at most so long, until `enough`.
  template <typename Condition>
  Status poll_until(Duration longest, Condition enough) {
    const Time end = clock_now() + longest;
    Status status = Status::kNotReady;
    while (clock_now() < end && !enough()) {
      stim300::Samples samples;
      const Time before = clock_now();
      status = device_->poll(before, Duration::from_ms(10), samples);
      if (!samples.empty()) {
        EXPECT_GE(device_->arrived(), before);
        EXPECT_LE(device_->arrived(), clock_now());
      }
      samples_.insert(samples_.end(), samples.begin(), samples.end());
      if (status == Status::kRejected) return status;
    }
    return status;
  }
  const stim300::Counters& counters() const { return device_->protocol().counters(); }

  Stim300OnPty unit_{{}, 1};
  std::unique_ptr<LinuxSerialPort> port_;
  std::unique_ptr<Device> device_;
  std::vector<ImuSample> samples_;
};

constexpr Duration kPatience = Duration::from_ms(20'000);  // for a busy machine; usually a second

TEST_F(Stim300Device, SamplesFromEndToEnd) {
  unit_.with_unit([](emulator::Stim300Emulator& unit) { unit.set_rate(rate_at); });
  open();
  (void)poll_until(kPatience, [&] { return samples_.size() >= 250; });
  ASSERT_GE(samples_.size(), 250U);
  EXPECT_EQ(device_->protocol().state(), State::kConfigured);
  EXPECT_GT(counters().starting, 0U);
  EXPECT_EQ(device_->protocol().framer().checksum_errors, 0U);
  // The clocks are the same one, so a stamp is off by what the least late datagrams were late, never early by more than
  // their drift: motion and stamp agree as well as the machine has let any datagram through.
  double worst = 0.0;
  for (const ImuSample& sample : samples_) {
    worst = std::max(worst, std::abs(sample.gyro_rad_s[0] - rate_at(sample.t.seconds())[0]));
    EXPECT_NEAR(sample.gyro_rad_s[1], -0.3, 1e-4);
    EXPECT_NEAR(sample.accel_m_s2[2], 9.80665, 1e-3);
  }
  EXPECT_LT(worst, 1.2 * 0.020) << "stamps off by 20 ms";
}

// A unit that has been running for long is asked, because what it told at power-on is gone.
TEST_F(Stim300Device, AsksARunningUnitForItsConfiguration) {
  open();
  (void)poll_until(kPatience, [&] { return counters().starting > 0; });
  device_.reset();
  port_.reset();
  open();  // a new driver on the running unit
  (void)poll_until(kPatience, [&] { return samples_.size() >= 10; });
  EXPECT_EQ(counters().restarts, 0U);
  EXPECT_EQ(device_->protocol().state(), State::kConfigured);
  EXPECT_GE(samples_.size(), 10U);
}

TEST_F(Stim300Device, HearsOnlyNoiseAtTheWrongSpeed) {
  open(460800);
  (void)poll_until(Duration::from_ms(1500), [&] { return device_->protocol().framer().skipped_bytes > 2000; });
  EXPECT_EQ(device_->protocol().state(), State::kUnconfigured);
  EXPECT_GT(device_->protocol().framer().skipped_bytes, 500U);
  EXPECT_EQ(device_->protocol().framer().datagrams, 0U);
}

TEST_F(Stim300Device, ReportsALineThatIsGone) {
  open();
  (void)poll_until(kPatience, [&] { return samples_.size() >= 10; });
  unit_.hang_up();
  EXPECT_EQ(poll_until(kPatience, [] { return false; }), Status::kRejected);
  EXPECT_NE(port_->last_error(), 0);
}

TEST_F(Stim300Device, SurvivesADamagedLine) {
  open();
  (void)poll_until(kPatience, [&] { return samples_.size() >= 10; });
  unit_.with_unit([](emulator::Stim300Emulator& unit) {
    unit.faults().flipped_bit = 0.01;
    unit.faults().lost_byte = 0.005;
  });
  (void)poll_until(kPatience, [&] { return samples_.size() >= 100; });
  EXPECT_GE(samples_.size(), 100U);
  EXPECT_GT(counters().missing, 0U);
  EXPECT_GT(device_->protocol().framer().skipped_bytes, 0U);
  for (const ImuSample& sample : samples_) EXPECT_NEAR(sample.accel_m_s2[2], 9.80665, 1e-3);
}

}  // namespace
}  // namespace plumb::test
