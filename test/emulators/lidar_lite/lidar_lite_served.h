#pragma once
// The emulated LIDAR-Lite as a character device, served by lidar_lite_cuse.

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <stdexcept>
#include <string>

namespace plumb::test {

/// The emulator in a process of its own, for as long as this lives. Throws std::runtime_error where it does not answer.
class LidarLiteServed {
 public:
  LidarLiteServed(const char* program, const char* model) {
    int to_server[2];
    int from_server[2];
    if (pipe(to_server) != 0 || pipe(from_server) != 0) throw std::runtime_error("no pipe can be made");
    process_ = fork();
    if (process_ == 0) {
      dup2(to_server[0], STDIN_FILENO);
      dup2(from_server[1], STDOUT_FILENO);
      close(to_server[1]);
      execl(program, program, "i2c-lidar", model, nullptr);
      _exit(127);
    }
    close(to_server[0]);
    close(from_server[1]);
    world_ = to_server[1];
    answers_ = from_server[0];
    expect_ready();
    for (int i = 0; i < 100 && access(kDevice, R_OK | W_OK) != 0; ++i) usleep(10'000);
  }
  ~LidarLiteServed() {
    close(world_);
    kill(process_, SIGTERM);
    waitpid(process_, nullptr, 0);
    close(answers_);
  }
  LidarLiteServed(const LidarLiteServed&) = delete;
  LidarLiteServed& operator=(const LidarLiteServed&) = delete;

  void set(const std::string& line) const {
    const std::string whole = line + "\n";
    if (write(world_, whole.data(), whole.size()) != static_cast<ssize_t>(whole.size())) {
      throw std::runtime_error("the emulated LIDAR-Lite hears nothing");
    }
    expect_ready();
  }
  static constexpr const char* kDevice = "/dev/i2c-lidar";

 private:
  void expect_ready() const {
    std::string line;
    // Byte by byte: a pipe may give a line in pieces, and what follows it belongs to the next answer.
    for (char byte = 0; byte != '\n' && read(answers_, &byte, 1) == 1;) line += byte;
    if (line != "ready\n") throw std::runtime_error("the emulated LIDAR-Lite answers: " + line);
  }

  pid_t process_ = -1;
  int world_ = -1;    ///< to its standard input
  int answers_ = -1;  ///< from its standard output
};

}  // namespace plumb::test
