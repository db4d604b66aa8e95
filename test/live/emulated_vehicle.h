#pragma once
// The devices of a vehicle on real interfaces of the system and in real time: a STIM300 on a pseudo-terminal, a camera,
// and a range finder where the kernel has something for it.

#include <array>
#include <atomic>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "test/emulators/can_range/can_range_on_bus.h"
#include "test/emulators/lidar_lite/lidar_lite_served.h"
#include "test/emulators/stim300/stim300_on_pty.h"
#include "test/live/plane_flight.h"
#include "tools/hil/video_output.h"

namespace plumb::test {

/// What the devices are behind. Empty: not that way.
struct VehicleInterfaces {
  std::filesystem::path camera_socket{};  ///< of a camera daemon
  std::string camera_device{};            ///< v4l2loopback
  std::string can{};                      ///< interface of a range finder
  const char* lidar_lite = nullptr;       ///< program that serves one as LidarLiteServed::kDevice
  std::int64_t image_period_ns = 50'000'000;
};

enum class VehicleDevice : std::uint8_t { kImu = 0, kCamera, kRange };

class EmulatedVehicle {
 public:
  static constexpr std::int64_t kExposure_ns = 4'000'000;
  static constexpr std::int64_t kReadout_ns = 8'000'000;
  static constexpr std::int64_t kRangePeriod_ns = 40'000'000;

  /// The flight begins when everything is ready.
  EmulatedVehicle(VehicleInterfaces interfaces, double longest_s);
  ~EmulatedVehicle();

  const std::string& imu_device() const { return imu_.device(); }
  double image_rate_hz() const { return 1e9 / static_cast<double>(interfaces_.image_period_ns); }
  /// Takes a device away or puts it back.
  void plug(VehicleDevice device, bool in);
  /// What goes wrong on the line of the IMU, from now on.
  void disturb_imu(const emulator::Stim300Faults& faults);
  /// What is true, in seconds of CLOCK_MONOTONIC.
  const PlaneFlight& flight() const { return flight_; }
  double t_start_s() const { return 1e-9 * static_cast<double>(t_start_ns_); }

 private:
  bool is_away(VehicleDevice device) const { return away_[static_cast<std::size_t>(device)].load(); }
  void show(const std::stop_token& stop);
  void show_to_client(int& client, std::size_t index, std::int64_t t_end_ns) const;
  void measure_on_i2c(const std::stop_token& stop);

  VehicleInterfaces interfaces_;
  std::vector<std::vector<std::uint8_t>> images_;
  std::unique_ptr<LidarLiteServed> lidar_lite_;
  std::unique_ptr<CanRangeOnBus> can_;
  std::unique_ptr<hil::VideoOutput> video_;
  std::array<std::atomic<bool>, 3> away_{};
  int listening_;
  std::int64_t t_start_ns_;
  PlaneFlight flight_;
  emulator::Stim300OnPty imu_;
  std::jthread camera_;
  std::jthread range_;
};

}  // namespace plumb::test
