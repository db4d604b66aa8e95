// plumb-fsw as it is packed, live in the virtual flight computer, with a STIM300 on a pseudo-terminal, a LIDAR-Lite as
// an I2C bus and a camera on Video4Linux. Each is pulled for some seconds and put back. What is judged here is that the
// process flew; its log in flight.lcm is judged where it is brought back to (tools/tests/test_target.py).

#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <fstream>
#include <thread>

#include "test/emulators/ov7251/loopback_camera.h"
#include "test/live/emulated_vehicle.h"
#include "test/live/flight_program.h"
#include "test/unit/hal/kernel_part.h"

namespace plumb::test {
namespace {

constexpr const char* kFlightProgram = "/opt/plumb/bin/plumb-fsw";
constexpr double kLength_s = 24.0;

struct Pull {
  VehicleDevice device;
  double out_s;
  double in_s;
};
// From the start of the process. The vehicle moves from its third second on.
constexpr std::array<Pull, 3> kPulls = {{
    {VehicleDevice::kRange, 7.0, 10.0},
    {VehicleDevice::kCamera, 12.0, 15.0},
    {VehicleDevice::kImu, 17.0, 20.0},
}};

TEST(LiveTarget, FliesOnWhileEachDeviceIsPulled) {
  PLUMB_NEEDS_KERNEL("everything");
  EmulatedVehicle vehicle({.camera_device = emulator::LoopbackCamera::kDevice,
                           .lidar_lite = PLUMB_LIDAR_LITE_CUSE,
                           .image_period_ns = 100'000'000},
                          kLength_s + 4.0);
  std::ofstream("flight.yaml") << flight_configuration(
      vehicle.imu_device(), vehicle.image_rate_hz(), "flight.lcm",
      std::string("device: ") + emulator::LoopbackCamera::kDevice,
      "lcm: udpm://239.255.76.67:7667?ttl=0\n" +
          range_section(std::string("i2c: ") + LidarLiteServed::kDevice + "\n  model: v3"));
  const auto start = std::chrono::steady_clock::now();
  const auto wait_until = [start](double t_s) {
    std::this_thread::sleep_until(start + std::chrono::duration<double>(t_s));
  };
  FlightProgram program({kFlightProgram, "flight.yaml"}, "flight.txt");
  for (const Pull& pull : kPulls) {
    wait_until(pull.out_s);
    vehicle.plug(pull.device, false);
    wait_until(pull.in_s);
    vehicle.plug(pull.device, true);
  }
  wait_until(kLength_s);
  EXPECT_EQ(program.stop(), 0);
  std::printf("%s", program.output().c_str());
}

}  // namespace
}  // namespace plumb::test
