// One flight of all four devices through the kernel of the virtual flight computer: emulated units at one end, the
// drivers as they fly at the other, and each device pulled for three seconds and put back.

#include <gtest/gtest.h>
#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <memory>
#include <numbers>
#include <set>
#include <string>
#include <thread>

#include "drivers/can_range/receiver.h"
#include "drivers/lidar_lite/device.h"
#include "drivers/ov7251/device.h"
#include "drivers/stim300/device.h"
#include "hal/linux/can_socket.h"
#include "hal/linux/i2c_bus.h"
#include "hal/linux/monotonic_clock.h"
#include "hal/linux/serial_port.h"
#include "hal/linux/v4l2_camera.h"
#include "test/emulators/can_range/can_range_encoder.h"
#include "test/emulators/lidar_lite/lidar_lite_served.h"
#include "test/emulators/ov7251/loopback_camera.h"
#include "test/emulators/stim300/stim300_on_pty.h"
#include "test/unit/hal/kernel_part.h"

namespace plumb {
namespace {

using emulator::LoopbackCamera;
using emulator::Stim300Emulator;
using emulator::Stim300OnPty;
using test::LidarLiteServed;

// What the emulators are told. Steady, so that a measurement is right or wrong whenever it was made.
constexpr std::array kRate_rad_s = {0.1, -0.2, 0.3};
constexpr std::array kForce_m_s2 = {0.5, -0.25, 9.75};
constexpr double kLidarRange_m = 7.65;
constexpr double kCanRange_m = 12.5;

/// A DroneCAN range finder on vcan0, by plain system calls, 25 times a second.
class CanRangeFinder {
 public:
  CanRangeFinder() : socket_(socket(PF_CAN, SOCK_RAW, CAN_RAW)) {
    sockaddr_can address{};
    address.can_family = AF_CAN;
    address.can_ifindex = static_cast<int>(if_nametoindex("vcan0"));
    EXPECT_EQ(bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
  }
  ~CanRangeFinder() {
    thread_ = {};
    close(socket_);
  }

 private:
  void run(const std::stop_token& stop) const {
    for (unsigned transfer = 0; !stop.stop_requested(); ++transfer) {
      for (const CanFrame& frame : test::measurement_frames({}, kCanRange_m, 1, transfer % 32)) {
        can_frame out{};
        out.can_id = frame.id | CAN_EFF_FLAG;
        out.can_dlc = frame.size;
        std::copy(frame.bytes.begin(), frame.bytes.end(), out.data);
        (void)!write(socket_, &out, sizeof out);  // fails while the interface is down
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(40));
    }
  }

  int socket_;
  std::jthread thread_;
};

struct Tally {
  explicit Tally(const char* device) : name(device) {}
  const char* name;
  int right = 0;
  int wrong = 0;
  Time last = Time::never();  ///< when it was taken
  double longest_silence_s = 0.0;
};

/// The four devices and their drivers, polled in turn by one thread as the executive does.
class Flight {
 public:
  Flight() : unit_({}, 11), log_("flight.csv") {
    unit_.with_unit([](Stim300Emulator& unit) {
      unit.set_rate([](double) { return kRate_rad_s; });
      unit.set_specific_force([](double) { return kForce_m_s2; });
    });
    lidar_.set("range_m " + std::to_string(kLidarRange_m));
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
    can_range::Receiver range_finder(*can_, {});
    ov7251::Device camera(*camera_, {.auto_exposure = false});
    ASSERT_EQ(range_finder.start(), Status::kOk);
    ASSERT_EQ(camera.start(), Status::kOk);
    const Time begin = clock_now();
    std::size_t step = 0;
    for (Time now = begin; now - begin < kLength; now = clock_now()) {
      while (step < steps_.size() && now - begin >= steps_[step].at) steps_[step++].act();
      poll_imu(imu, now);
      if (const Result<RangeSample> sample = lidar.poll(now)) on_range(lidar_tally_, *sample, kLidarRange_m);
      while (const Result<can_range::Reading> reading = range_finder.poll(Duration())) {
        on_range(can_tally_, reading->sample, kCanRange_m);
      }
      if (const Result<CameraFrame> frame = camera.poll(now, Duration())) on_image(*frame);
      usleep(1000);
    }
    std::printf("flight of %.1f s:", kLength.seconds());
    for (const Tally* tally : {&imu_tally_, &lidar_tally_, &can_tally_, &camera_tally_}) {
      std::printf(" %s %d right %d wrong;", tally->name, tally->right, tally->wrong);
    }
    std::printf(" camera lost %u, imu missing %llu\n", camera.protocol().counters().lost,
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
  void on_imu(const ImuSample& sample) {
    // The least step of an increment in one of 250 datagrams a second, and half of it for the emulator's rounding.
    constexpr double kRateStep_rad_s = 250.0 / (1 << 21) * std::numbers::pi / 180.0;
    constexpr double kForceStep_m_s2 = 250.0 / (1 << 22);
    bool right = true;
    for (std::size_t i = 0; i < 3; ++i) {
      right = right && std::abs(sample.gyro_rad_s[i] - kRate_rad_s[i]) < 1.5 * kRateStep_rad_s &&
              std::abs(sample.accel_m_s2[i] - kForce_m_s2[i]) < 1.5 * kForceStep_m_s2;
    }
    note(imu_tally_, sample.t, right);
    for (const double value : sample.gyro_rad_s) log_ << ',' << value;
    for (const double value : sample.accel_m_s2) log_ << ',' << value;
    log_ << '\n';
  }
  void on_range(Tally& tally, const RangeSample& sample, double told_m) {
    const bool right = sample.quality == RangeQuality::kValid && std::abs(sample.range_m - told_m) < 1e-6;
    note(tally, sample.t, right);
    log_ << ',' << sample.range_m << '\n';
  }
  void on_image(const CameraFrame& frame) {
    const std::int64_t index = source_.index_of(frame.image);
    note(camera_tally_, frame.t_exposure_mid, index >= 0 && images_.insert(index).second);
    log_ << ',' << frame.sequence << ',' << index << '\n';
  }
  static void shell(const char* command) { EXPECT_EQ(std::system(command), 0) << command; }
  void plug(bool in) {
    unit_.with_unit([in](Stim300Emulator& unit) { unit.faults().unplugged = !in; });
  }

  Stim300OnPty unit_;
  LidarLiteServed lidar_{PLUMB_LIDAR_LITE_CUSE, "v3"};
  CanRangeFinder range_finder_;
  LoopbackCamera source_;
  std::unique_ptr<LinuxSerialPort> serial_;
  std::unique_ptr<LinuxI2cBus> bus_;
  std::unique_ptr<LinuxCanSocket> can_;
  std::unique_ptr<V4l2Camera> camera_;
  stim300::Samples samples_;
  std::set<std::int64_t> images_;  ///< seen already
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
