// One flight of all four devices through the kernel of the virtual flight computer: emulated units at one end, the
// drivers as they fly at the other, and each device pulled for three seconds and put back.

#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <memory>
#include <numbers>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "drivers/can_range/receiver.h"
#include "drivers/lidar_lite/device.h"
#include "drivers/ov7251/device.h"
#include "drivers/stim300/device.h"
#include "hal/linux/can_socket.h"
#include "hal/linux/i2c_bus.h"
#include "hal/linux/monotonic_clock.h"
#include "hal/linux/serial_port.h"
#include "hal/linux/v4l2_camera.h"
#include "test/emulators/can_range/can_range_on_bus.h"
#include "test/emulators/lidar_lite/lidar_lite_served.h"
#include "test/emulators/ov7251/loopback_camera.h"
#include "test/emulators/stim300/stim300_on_pty.h"
#include "test/unit/hal/kernel_part.h"

namespace plumb {
namespace {

using emulator::LoopbackCamera;
using emulator::Stim300Emulator;
using emulator::Stim300OnPty;
using test::CanRangeEmulator;
using test::CanRangeOnBus;
using test::LidarLiteServed;

// What the IMU is told, in seconds since it was switched on. All of it changes from one sample to the next, so that the
// first axis tells the time of a sample, to 0.2 ms, and the others have to be of that time.
constexpr std::array kRate_rad_s = {0.1, -0.2, 0.3};
constexpr std::array kRateChange_rad_s2 = {0.01, -0.006, 0.004};
constexpr std::array kForce_m_s2 = {0.5, -0.25, 9.75};
constexpr std::array kForceChange_m_s3 = {0.03, 0.02, -0.01};
// Range finders are told anything, so that a range that is not the one of its time, or not of its device, is seen. From
// 8 to 16 m DroneCAN has steps of 7.8 mm, and the LIDAR-Lite has them of a centimetre.
constexpr double kNearest_m = 8.0;
constexpr double kFarthest_m = 16.0;
constexpr double kCanStep_m = 1.0 / 128.0;
constexpr double kLidarStep_m = 0.01;

std::array<double, 3> line_at(const std::array<double, 3>& start, const std::array<double, 3>& change, double t_s) {
  return {start[0] + change[0] * t_s, start[1] + change[1] * t_s, start[2] + change[2] * t_s};
}

/// The ranges that a device was told, each from its time on.
class Told {
 public:
  explicit Told(unsigned seed) : random_(seed) {}
  double next(Time t) {
    told_.push_back({t, std::uniform_real_distribution(kNearest_m, kFarthest_m)(random_)});
    return told_.back().range_m;
  }
  /// Whether the range is the one of its time, to half a step, and not told before the last that was asked for.
  bool has(const RangeSample& sample, double step_m, Duration slack) {
    for (std::size_t i = last_; i < told_.size(); ++i) {
      const bool over = i + 1 < told_.size() && told_[i + 1].t + slack < sample.t;
      constexpr double kRounding = 1.001;
      if (over || told_[i].t > sample.t + slack ||
          std::abs(told_[i].range_m - sample.range_m) > 0.5 * kRounding * step_m)
        continue;
      last_ = i;
      return true;
    }
    return false;
  }

 private:
  struct Range {
    Time t;
    double range_m = 0.0;
  };
  std::mt19937 random_;
  std::vector<Range> told_;
  std::size_t last_ = 0;
};

struct Tally {
  explicit Tally(const char* device) : name(device) {}
  const char* name;
  int right = 0;
  int wrong = 0;
  Time last = Time::never();  ///< when it was taken
  double last_value = -1.0;   ///< of what rises from sample to sample
  double longest_silence_s = 0.0;
};

/// The four devices and their drivers, polled in turn by one thread as the executive does.
class Flight {
 public:
  Flight() : unit_({}, 11), log_("flight.csv") {
    unit_.with_unit([this](Stim300Emulator& unit) {
      unit.set_rate([this](double t_s) { return line_at(kRate_rad_s, kRateChange_rad_s2, t_s - t_on_.seconds()); });
      unit.set_specific_force(
          [this](double t_s) { return line_at(kForce_m_s2, kForceChange_m_s3, t_s - t_on_.seconds()); });
    });
    range_finder_.with_unit([this](CanRangeEmulator& unit) {
      unit.set_motion([this](std::int64_t t_ns) { return std::optional(can_told_.next(Time::from_ns(t_ns))); });
    });
    std::string error;
    serial_ = LinuxSerialPort::open(unit_.device(), {}, error);
    bus_ = LinuxI2cBus::open(LidarLiteServed::kDevice, error);
    can_ = LinuxCanSocket::open("vcan0", error);
    camera_ = V4l2Camera::open({.device = LoopbackCamera::kDevice}, error);
    EXPECT_TRUE(serial_ && bus_ && can_ && camera_) << error;
    log_ << "t_s,device,values\n" << std::fixed;
  }

  void run() {
    stim300::Device imu(*serial_, {});
    lidar_lite::Device lidar(*bus_, {});
    can_range::Receiver range_finder(*can_, {.latency = Duration::from_ns(CanRangeEmulator::kLatency_ns)});
    ov7251::Device camera(*camera_, {.auto_exposure = false});
    ASSERT_EQ(range_finder.start(), Status::kOk);
    ASSERT_EQ(camera.start(), Status::kOk);
    std::size_t step = 0;
    const Time start = clock_now();
    Time t_tell = start;
    for (Time now = start; now - start < kLength; now = clock_now()) {
      while (step < steps_.size() && now - start >= steps_[step].at) steps_[step++].act();
      if (now >= t_tell) {
        lidar_.set("range_m " + std::to_string(lidar_told_.next(now)));
        t_tell = now + Duration::from_ms(100);
      }
      poll_imu(imu, now);
      if (const Result<RangeSample> sample = lidar.poll(now)) on_lidar(*sample);
      while (const Result<can_range::Reading> reading = range_finder.poll(Duration())) on_can(reading->sample);
      if (const Result<CameraFrame> frame = camera.poll(now, Duration())) on_image(*frame);
      usleep(1000);
    }
    std::printf("flight of %.1f s, %.1f s with its beginning and end:", kLength.seconds(), since_on_s(clock_now()));
    for (const Tally* tally : {&imu_tally_, &lidar_tally_, &can_tally_, &camera_tally_}) {
      std::printf(" %s %d right %d wrong;", tally->name, tally->right, tally->wrong);
    }
    std::printf(" camera lost %llu, imu missing %llu\n",
                static_cast<unsigned long long>(camera.protocol().counters().lost),
                static_cast<unsigned long long>(imu.protocol().counters().missing));
  }

  void check() const {
    constexpr int kLeast = 100;
    for (const Tally* tally : {&imu_tally_, &lidar_tally_, &can_tally_, &camera_tally_}) {
      SCOPED_TRACE(tally->name);
      EXPECT_EQ(tally->wrong, 0);
      EXPECT_GE(tally->right, kLeast);
      // Silent once, for the three seconds that it was away and what it took to come back.
      EXPECT_GE(tally->longest_silence_s, 2.5);
      EXPECT_LE(tally->longest_silence_s, 6.0);
    }
  }

 private:
  static constexpr Duration kLength = Duration::from_ms(30'000);
  /// An emulated processor may be late by so much with what was measured.
  static constexpr Duration kStampError = Duration::from_ms(500);
  struct Step {
    Duration at;
    std::function<void()> act;
  };

  void poll_imu(stim300::Device& imu, Time now) {
    for (int reads = 0; reads < 8; ++reads) {  // all that has come, for the line is faster than one read a turn
      if (!ok(imu.poll(now, Duration(), samples_))) return;
      for (const ImuSample& sample : samples_) on_imu(sample);
    }
  }
  void note(Tally& tally, Time t, bool right) {
    ++(right ? tally.right : tally.wrong);
    const Time now = clock_now();
    if (tally.last > Time::never()) {
      tally.longest_silence_s = std::max(tally.longest_silence_s, (now - tally.last).seconds());
    }
    tally.last = now;
    log_ << t.seconds() << ',' << tally.name;
  }
  double since_on_s(Time t) const { return (t - t_on_).seconds(); }
  void on_imu(const ImuSample& sample) {
    // The least step of an increment in one of 250 datagrams a second, and half of it for the emulator's rounding.
    constexpr double kRateStep_rad_s = 250.0 / (1 << 21) * std::numbers::pi / 180.0;
    constexpr double kForceStep_m_s2 = 250.0 / (1 << 22);
    constexpr double kSteps = 2.5;  // of the axis and of the one that tells the time, each rounded and joined
    const double t_told_s = (sample.gyro_rad_s[0] - kRate_rad_s[0]) / kRateChange_rad_s2[0];
    const std::array<double, 3> rate_rad_s = line_at(kRate_rad_s, kRateChange_rad_s2, t_told_s);
    const std::array<double, 3> force_m_s2 = line_at(kForce_m_s2, kForceChange_m_s3, t_told_s);
    bool right = sample.gyro_rad_s[0] > imu_tally_.last_value &&
                 std::abs(t_told_s - since_on_s(sample.t)) < kStampError.seconds();
    imu_tally_.last_value = sample.gyro_rad_s[0];
    for (std::size_t i = 0; i < 3; ++i) {
      right = right && std::abs(sample.gyro_rad_s[i] - rate_rad_s[i]) < kSteps * kRateStep_rad_s &&
              std::abs(sample.accel_m_s2[i] - force_m_s2[i]) < kSteps * kForceStep_m_s2;
    }
    note(imu_tally_, sample.t, right);
    for (const double value : sample.gyro_rad_s) log_ << ',' << value;
    for (const double value : sample.accel_m_s2) log_ << ',' << value;
    log_ << '\n';
  }
  void on_lidar(const RangeSample& sample) {
    on_range(lidar_tally_, sample, lidar_told_.has(sample, kLidarStep_m, kStampError));
  }
  void on_can(const RangeSample& sample) {
    bool right = false;
    range_finder_.with_unit([&](CanRangeEmulator&) { right = can_told_.has(sample, kCanStep_m, kStampError); });
    on_range(can_tally_, sample, right);
  }
  void on_range(Tally& tally, const RangeSample& sample, bool right) {
    note(tally, sample.t, sample.quality == RangeQuality::kValid && right);
    log_ << ',' << sample.range_m << '\n';
  }
  void on_image(const CameraFrame& frame) {
    const std::int64_t index = source_.index_of(frame.image);
    note(camera_tally_, frame.t_exposure_mid, static_cast<double>(index) > camera_tally_.last_value);
    camera_tally_.last_value = static_cast<double>(index);
    log_ << ',' << frame.sequence << ',' << index << '\n';
  }
  static void shell(const char* command) { EXPECT_EQ(std::system(command), 0) << command; }
  void plug(bool in) {
    unit_.with_unit([in](Stim300Emulator& unit) { unit.faults().unplugged = !in; });
  }

  const Time t_on_ = clock_now();
  Told lidar_told_{21};
  Told can_told_{22};  // by the thread of its unit
  Stim300OnPty unit_;
  LidarLiteServed lidar_{PLUMB_LIDAR_LITE_CUSE, "v3"};
  CanRangeOnBus range_finder_{"vcan0", CanRangeEmulator::Kind::kDronecan, 12};
  LoopbackCamera source_;
  std::unique_ptr<LinuxSerialPort> serial_;
  std::unique_ptr<LinuxI2cBus> bus_;
  std::unique_ptr<LinuxCanSocket> can_;
  std::unique_ptr<V4l2Camera> camera_;
  stim300::Samples samples_;
  Tally imu_tally_{"imu"};
  Tally lidar_tally_{"lidar"};
  Tally can_tally_{"can"};
  Tally camera_tally_{"camera"};
  std::ofstream log_;
  const std::vector<Step> steps_ = {
      {Duration::from_ms(6'000), [this] { plug(false); }},
      {Duration::from_ms(9'000), [this] { plug(true); }},
      {Duration::from_ms(12'000), [this] { lidar_.set("dead 1"); }},
      {Duration::from_ms(15'000), [this] { lidar_.set("dead 0"); }},
      {Duration::from_ms(18'000), [] { shell("ip link set vcan0 down"); }},
      {Duration::from_ms(21'000), [] { shell("ip link set vcan0 up"); }},
      {Duration::from_ms(24'000), [this] { source_.pull(); }},
      {Duration::from_ms(27'000), [this] { source_.put_back(); }},
  };
};

TEST(TargetFlight, MeasuresWhatItWasToldAndGoesOnAfterEachDeviceWasPulled) {
  PLUMB_NEEDS_KERNEL("everything");
  Flight flight;
  flight.run();
  flight.check();
}

}  // namespace
}  // namespace plumb
