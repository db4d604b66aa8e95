#pragma once
// The devices of a vehicle on real interfaces of the system and in real time: a STIM300 on a pseudo-terminal, a camera
// behind a Unix socket, and where the kernel has CAN a range finder on it.

#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "test/emulators/stim300/stim300_on_pty.h"
#include "test/live/plane_flight.h"

namespace plumb::test {

class EmulatedVehicle {
 public:
  static constexpr std::int64_t kImagePeriod_ns = 50'000'000;
  static constexpr std::int64_t kExposure_ns = 4'000'000;
  static constexpr std::int64_t kReadout_ns = 8'000'000;
  static constexpr std::int64_t kRangePeriod_ns = 40'000'000;

  /// The flight begins when everything is ready. `can`: name of an interface; empty for no range finder.
  EmulatedVehicle(std::filesystem::path camera_socket, std::string can, double longest_s);
  ~EmulatedVehicle();

  const std::string& imu_device() const { return imu_.device(); }

 private:
  void show(const std::stop_token& stop);
  void measure(const std::stop_token& stop);

  std::filesystem::path socket_path_;
  std::string can_;
  std::vector<std::vector<std::uint8_t>> images_;
  std::int64_t t_start_ns_;
  PlaneFlight flight_;
  int listening_;
  emulator::Stim300OnPty imu_;
  std::jthread camera_;
  std::jthread range_;
};

}  // namespace plumb::test
