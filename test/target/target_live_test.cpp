// plumb-fsw as it is packed, live in the virtual flight computer, with a STIM300 on a pseudo-terminal, a LIDAR-Lite as
// an I2C bus or a range finder on CAN, and a camera on Video4Linux. Each is pulled for some seconds and put back. What
// is judged here is that the process flew; its logs are judged where they are brought back to
// (tools/tests/test_target.py).

#include <gtest/gtest.h>

#include <chrono>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "test/emulators/ov7251/loopback_camera.h"
#include "test/live/emulated_vehicle.h"
#include "test/live/flight_program.h"
#include "test/unit/hal/kernel_part.h"

namespace plumb::test {
namespace {

constexpr const char* kFlightProgram = "/opt/plumb/bin/plumb-fsw";

struct Pull {
  VehicleDevice device;
  double out_s;
  double in_s;
};

/// Times are from the start of the process. The vehicle moves from its third second on. What is written is NAME.yaml,
/// NAME.lcm and NAME.txt.
void fly(const std::string& name, VehicleInterfaces interfaces, const std::string& range,
         const std::vector<Pull>& pulls, double length_s) {
  interfaces.camera_device = emulator::LoopbackCamera::kDevice;
  interfaces.image_period_ns = 100'000'000;
  EmulatedVehicle vehicle(interfaces, length_s + 4.0);
  std::ofstream(name + ".yaml") << flight_configuration(
      vehicle.imu_device(), vehicle.image_rate_hz(), name + ".lcm",
      std::string("device: ") + emulator::LoopbackCamera::kDevice,
      "lcm: udpm://239.255.76.67:7667?ttl=0\n" + range_section(range));
  const auto start = std::chrono::steady_clock::now();
  const auto wait_until = [start](double t_s) {
    std::this_thread::sleep_until(start + std::chrono::duration<double>(t_s));
  };
  FlightProgram program({kFlightProgram, name + ".yaml"}, name + ".txt");
  for (const Pull& pull : pulls) {
    wait_until(pull.out_s);
    vehicle.plug(pull.device, false);
    wait_until(pull.in_s);
    vehicle.plug(pull.device, true);
  }
  wait_until(length_s);
  EXPECT_EQ(program.stop(), 0);
  std::printf("%s", program.output().c_str());
}

TEST(LiveTarget, FliesOnWhileEachDeviceIsPulled) {
  PLUMB_NEEDS_KERNEL("everything");
  fly("flight", {.lidar_lite = PLUMB_LIDAR_LITE_CUSE},
      std::string("i2c: ") + LidarLiteServed::kDevice + "\n  model: v3",
      {{VehicleDevice::kRange, 7.0, 10.0}, {VehicleDevice::kCamera, 12.0, 15.0}, {VehicleDevice::kImu, 17.0, 20.0}},
      24.0);
}

// A flight has one range finder, so that on CAN has a flight of its own, as short as shows it.
TEST(LiveTarget, FliesOnWhileTheRangeFinderOnCanIsPulled) {
  PLUMB_NEEDS_KERNEL("everything");
  fly("can", {.can = "vcan0"}, "can: vcan0\n  latency_ms: 2", {{VehicleDevice::kRange, 7.0, 10.0}}, 12.0);
}

}  // namespace
}  // namespace plumb::test
