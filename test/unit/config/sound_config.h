#pragma once
// A configuration of plumb-fsw in which nothing is wrong, to spoil.

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "config/flight_config.h"

namespace plumb::test {

inline const std::string kSound = R"(log: flight.lcm
lcm: udpm://239.255.76.67:7667?ttl=0
commands: network
imu:
  device: /dev/ttyS1
  accel_range_g: 10
  T_BS: {data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}
  gyroscope_noise_density: 1e-4
  gyroscope_random_walk: 2e-5
  accelerometer_noise_density: 3e-3
  accelerometer_random_walk: 4e-3
camera:
  socket: /run/plumb/camera
  rate_hz: 20
  exposure_ms: 4
  T_BS: {data: [0, -1, 0, 0.5, 1, 0, 0, 0.25, 0, 0, 1, 0.125, 0, 0, 0, 1]}
  camera_model: pinhole
  resolution: [640, 480]
  intrinsics: [400, 410, 319.5, 239.5]
  distortion_model: none
range:
  can: can0
  node_id: 42
  own_node_id: 21
  noise_stddev_m: 0.05
  max_range_m: 40
  axis_in_cam: [0, 0, 1]
  origin_in_cam_m: [0, 0.02, 0]
parameters:
  vision.pixel_noise: 0.8
threads:
  tick: {priority: 90, core: 3}
)";

/// The sound file with pieces of it replaced, in their order.
inline std::string with_all(const std::vector<std::pair<std::string, std::string>>& pieces) {
  std::string text = kSound;
  for (const auto& [piece, by] : pieces) {
    const std::size_t at = text.find(piece);
    EXPECT_NE(at, std::string::npos) << piece;
    text.replace(at, piece.size(), by);
  }
  return text;
}

/// The sound file with a piece of it replaced.
inline std::string with(const std::string& piece, const std::string& by) { return with_all({{piece, by}}); }

inline std::vector<std::string> faults_of(const std::string& text) {
  std::vector<std::string> faults;
  read_flight_config("flight.yaml", text, faults);
  return faults;
}

inline bool names(const std::vector<std::string>& faults, const std::string& what) {
  return std::any_of(faults.begin(), faults.end(),
                     [&](const std::string& fault) { return fault.find(what) != std::string::npos; });
}

}  // namespace plumb::test
