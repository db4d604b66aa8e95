#pragma once
// plumb-fsw beside the emulated vehicle: its configuration, its process, and what it says at its end.

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "test/live/emulated_vehicle.h"
#include "test/support/temporary_folder.h"

extern char** environ;

namespace plumb::test {

/// `camera`: the key and value that say where it is. `more`: further sections.
inline std::string flight_configuration(const EmulatedVehicle& vehicle, const std::filesystem::path& log,
                                        const std::string& camera, const std::string& more) {
  const std::string eye = "T_BS: {data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}\n";
  return "log: " + log.string() + "\nimu:\n  device: " + vehicle.imu_device() + "\n  " + eye +
         "  gyroscope_noise_density: 1e-4\n  gyroscope_random_walk: 1e-5\n"
         "  accelerometer_noise_density: 2e-3\n  accelerometer_random_walk: 1e-3\n"
         "camera:\n  " +
         camera +
         "\n  exposure_ms: 4\n  readout_ms: 8\n"
         "  T_BS: {data: [1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1]}\n"
         "  camera_model: pinhole\n  resolution: [320, 240]\n  intrinsics: [250, 250, 159.5, 119.5]\n"
         "  distortion_model: none\n  rate_hz: " +
         std::to_string(vehicle.image_rate_hz()) + "\n" + more;
}

/// The section of a range finder beside the camera. `device`: the key and value that say what it is.
inline std::string range_section(const std::string& device) {
  return "range:\n  " + device +
         "\n  noise_stddev_m: 0.02\n  max_range_m: 40\n  axis_in_cam: [0, 0, 1]\n  origin_in_cam_m: [0, 0, 0]\n";
}

/// plumb-fsw with its output in a file.
class FlightProgram {
 public:
  /// `niceness`: 0 is the system's usual share of its time, 19 the least.
  FlightProgram(const char* fsw, const std::filesystem::path& config, std::filesystem::path output, int niceness)
      : output_(std::move(output)) {
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, 1, output_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    posix_spawn_file_actions_adddup2(&actions, 1, 2);
    std::vector<std::string> words = {fsw, config.string()};
    if (niceness != 0) words.insert(words.begin(), {"nice", "-n", std::to_string(niceness)});
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    EXPECT_EQ(posix_spawnp(&process_, arguments[0], &actions, nullptr, arguments.data(), environ), 0);
    posix_spawn_file_actions_destroy(&actions);
  }

  /// Exit code.
  int stop() {
    kill(process_, SIGTERM);
    int status = 0;
    waitpid(process_, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  std::string output() const { return content_of(output_); }

 private:
  std::filesystem::path output_;
  pid_t process_ = -1;
};

/// The number behind a word in the program's summary.
inline long number_after(const std::string& text, const std::string& word) {
  const std::size_t at = text.find(word);
  return at == std::string::npos ? -1 : std::atol(text.c_str() + at + word.size());
}

}  // namespace plumb::test
