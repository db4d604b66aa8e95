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
    char ready[6]{};
    EXPECT_EQ(read(from_server[0], ready, 5), 5);
    EXPECT_STREQ(ready, "ready");
    for (int i = 0; i < 100 && access(kDevice, R_OK | W_OK) != 0; ++i) usleep(10'000);
    close(from_server[0]);
  }
  ~LidarLiteServed() {
    close(world_);
    kill(process_, SIGTERM);
    waitpid(process_, nullptr, 0);
  }
  void set(const std::string& line) const {
    const std::string whole = line + "\n";
    EXPECT_EQ(write(world_, whole.data(), whole.size()), static_cast<ssize_t>(whole.size()));
    usleep(50'000);  // the server reads it on a thread of its own
  }
  static constexpr const char* kDevice = "/dev/i2c-lidar";

 private:
  pid_t process_ = -1;
  int world_ = -1;
};

}  // namespace plumb::test
