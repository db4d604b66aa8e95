#include "test/live/flight_program.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>

#include <cstdlib>
#include <stdexcept>

#include "test/support/temporary_folder.h"

extern char** environ;

namespace plumb::test {

std::string flight_configuration(const std::string& imu_device, double image_rate_hz, const std::filesystem::path& log,
                                 const std::string& camera, const std::string& more) {
  const std::string eye = "T_BS: {data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}\n";
  return "log: " + log.string() + "\nimu:\n  device: " + imu_device + "\n  " + eye +
         "  gyroscope_noise_density: 1e-4\n  gyroscope_random_walk: 1e-5\n"
         "  accelerometer_noise_density: 2e-3\n  accelerometer_random_walk: 1e-3\n"
         "camera:\n  " +
         camera +
         "\n  exposure_ms: 4\n  readout_ms: 8\n"
         "  T_BS: {data: [1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1]}\n"
         "  camera_model: pinhole\n  resolution: [320, 240]\n  intrinsics: [250, 250, 159.5, 119.5]\n"
         "  distortion_model: none\n  rate_hz: " +
         std::to_string(image_rate_hz) + "\n" + more;
}

std::string range_section(const std::string& device) {
  return "range:\n  " + device +
         "\n  noise_stddev_m: 0.02\n  max_range_m: 40\n  axis_in_cam: [0, 0, 1]\n  origin_in_cam_m: [0, 0, 0]\n";
}

FlightProgram::FlightProgram(std::vector<std::string> words, std::filesystem::path output)
    : output_(std::move(output)) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, 1, output_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  posix_spawn_file_actions_adddup2(&actions, 1, 2);
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  const int failed = posix_spawnp(&process_, words.front().c_str(), &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failed != 0) throw std::runtime_error(words.front() + " cannot be started");
}

FlightProgram::~FlightProgram() { kill(); }

int FlightProgram::stop() {
  send(SIGTERM);
  return wait();
}

void FlightProgram::kill() {
  send(SIGKILL);
  wait();
}

void FlightProgram::send(int signal) const {
  if (process_ > 0) ::kill(process_, signal);
}

int FlightProgram::wait() {
  if (process_ <= 0) return -1;
  int status = 0;
  waitpid(process_, &status, 0);
  process_ = -1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

std::string FlightProgram::output() const { return content_of(output_); }

long number_after(const std::string& text, const std::string& word) {
  const std::size_t at = text.find(word);
  return at == std::string::npos ? -1 : std::atol(text.c_str() + at + word.size());
}

}  // namespace plumb::test
