#pragma once
// The emulated LIDAR-Lite as a character device, served by lidar_lite_cuse.

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <string>

namespace plumb::test {

/// The emulator in a process of its own, for as long as this lives.
class LidarLiteServed {
 public:
  LidarLiteServed(const char* program, const char* model) {
    int to_server[2];
    int from_server[2];
    EXPECT_EQ(pipe(to_server), 0);
    EXPECT_EQ(pipe(from_server), 0);
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
    EXPECT_EQ(write(world_, whole.data(), whole.size()), static_cast<ssize_t>(whole.size()));
    expect_ready();
  }
  static constexpr const char* kDevice = "/dev/i2c-lidar";

 private:
  void expect_ready() const {
    std::string line;
    // Byte by byte: a pipe may give a line in pieces, and what follows it belongs to the next answer.
    for (char byte = 0; byte != '\n' && read(answers_, &byte, 1) == 1;) line += byte;
    EXPECT_EQ(line, "ready\n");
  }

  pid_t process_ = -1;
  int world_ = -1;    ///< to its standard input
  int answers_ = -1;  ///< from its standard output
};

}  // namespace plumb::test
