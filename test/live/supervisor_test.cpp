// The supervisor with threads that move or do not, and a real socket in the place of systemd's.

#include "process/supervisor.h"

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <chrono>
#include <thread>

#include "test/support/service_socket.h"
#include "test/support/temporary_folder.h"

namespace plumb::test {
namespace {

using std::chrono::milliseconds;

/// Turns until it is told to stop turning, or to end.
class Turning {
 public:
  Turning(ProgressBoard& board, FlightThread key)
      : thread_([this, &board, key](const std::stop_token& stop) {
          while (!stop.stop_requested()) {
            if (!hangs.load()) board.moved(key);
            std::this_thread::sleep_for(milliseconds(1));
          }
        }) {}
  std::atomic<bool> hangs{false};

 private:
  std::jthread thread_;
};

TEST(Supervisor, StrokesOnlyWhileEveryThreadMoves) {
  const TemporaryFolder folder;
  ServiceSocket systemd(folder.path() / "notify");
  ServiceManager manager(systemd.name(), Duration::from_ms(3000));
  ProgressBoard board;
  Supervisor supervisor(board, manager);
  Turning imu(board, FlightThread::kImu);
  Turning nav(board, FlightThread::kNav);
  Turning log(board, FlightThread::kLog);
  Turning command(board, FlightThread::kCommand);
  supervisor.watch(FlightThread::kImu);
  supervisor.watch(FlightThread::kNav);
  supervisor.look_after(FlightThread::kLog);
  const auto look = [&] {
    std::this_thread::sleep_for(milliseconds(200));
    return supervisor.look();
  };
  EXPECT_TRUE(look().empty());
  EXPECT_EQ(systemd.take(), std::vector<std::string>{"WATCHDOG=1"});
  nav.hangs = true;
  look();  // it may have moved once more
  systemd.take();
  EXPECT_EQ(look(), std::vector<std::string>{"nav"});
  EXPECT_TRUE(systemd.take().empty()) << "a thread that stops moving stops the stroke";
  nav.hangs = false;
  log.hangs = true;
  command.hangs = true;
  look();
  systemd.take();
  EXPECT_EQ(look(), std::vector<std::string>{"log"}) << "nobody looks after that of commands";
  EXPECT_EQ(systemd.take(), std::vector<std::string>{"WATCHDOG=1"});
}

TEST(Supervisor, LooksThreeTimesWithinTheWatchdogsTime) {
  const ProgressBoard board;
  ServiceManager patient("", Duration::from_ms(2400));
  EXPECT_EQ(Supervisor(board, patient).period(), Duration::from_ms(800));
  ServiceManager nobody("", Duration());
  EXPECT_EQ(Supervisor(board, nobody).period(), Supervisor::kLongestLook);
}

TEST(ServiceManager, ReachesASocketThatIsInNoFolder) {
  const std::string name = "@plumb-test-" + std::to_string(getpid());
  ServiceSocket systemd(name);
  ServiceManager manager(name, Duration());
  EXPECT_TRUE(manager.tell("READY=1"));
  EXPECT_EQ(systemd.take(), std::vector<std::string>{"READY=1"});
}

TEST(ServiceManager, ASocketThatIsGoneHoldsNobodyUp) {
  const TemporaryFolder folder;
  ServiceManager gone((folder.path() / "none").string(), Duration());
  EXPECT_FALSE(gone.tell("READY=1"));
  ServiceManager none("", Duration());
  EXPECT_FALSE(none.tell("READY=1"));
  ServiceManager endless(std::string(500, 'x'), Duration());
  EXPECT_FALSE(endless.tell("READY=1"));
}

TEST(ServiceManager, ReadsTheEnvironment) {
  setenv("WATCHDOG_USEC", "2500000", 1);
  EXPECT_EQ(ServiceManager::from_environment().watchdog(), Duration::from_ms(2500));
  setenv("WATCHDOG_PID", std::to_string(getpid()).c_str(), 1);
  EXPECT_EQ(ServiceManager::from_environment().watchdog(), Duration::from_ms(2500));
  setenv("WATCHDOG_PID", "1", 1);
  EXPECT_EQ(ServiceManager::from_environment().watchdog(), Duration()) << "another process is meant";
  unsetenv("WATCHDOG_PID");
  setenv("WATCHDOG_USEC", "soon", 1);
  EXPECT_EQ(ServiceManager::from_environment().watchdog(), Duration());
  unsetenv("WATCHDOG_USEC");
}

}  // namespace
}  // namespace plumb::test
