#include "hal/linux/realtime_thread.h"

#include <gtest/gtest.h>

#include <atomic>

#include "hal/linux/linux_clock.h"

namespace plumb {
namespace {

// Uses the stack below it, in a way that the compiler cannot take away.
void use_stack(void* context) {
  volatile unsigned char bytes[20'000];
  for (volatile unsigned char& byte : bytes) byte = 1;
  *static_cast<std::atomic<int>*>(context) = bytes[0];
}
void do_little(void* context) { *static_cast<std::atomic<int>*>(context) = 1; }

std::size_t stack_of(RealtimeThread::Entry entry) {
  std::vector<std::string> warnings;
  std::atomic<int> ran{0};
  RealtimeThread thread;
  EXPECT_TRUE(thread.start({.name = "test"}, entry, &ran, warnings));
  thread.join();
  EXPECT_EQ(ran, 1);
  return thread.stack_used();
}

TEST(RealtimeThread, TellsHowMuchOfItsStackWasUsed) {
  const std::size_t little = stack_of(do_little);
  const std::size_t more = stack_of(use_stack);
  EXPECT_GT(more, little + 18'000);
  EXPECT_LT(more, little + 24'000);
}

// A machine without the right to real-time scheduling, or with fewer cores, flies with a warning.
TEST(RealtimeThread, DoesWithoutWhatTheSystemDoesNotPermit) {
  std::vector<std::string> warnings;
  std::atomic<int> ran{0};
  RealtimeThread thread;
  ASSERT_TRUE(thread.start({.name = "test", .priority = 1000, .core = 1000}, do_little, &ran, warnings));
  thread.join();
  EXPECT_EQ(ran, 1);
  EXPECT_EQ(warnings.size(), 2U);
}

TEST(LinuxClock, WaitsUntilATimeOrAWake) {
  LinuxClock clock;
  const Time start = clock.now();
  clock.wait_until(start + Duration::from_ms(20));
  EXPECT_GE(clock.now(), start + Duration::from_ms(20));
  clock.wake();
  clock.wake();
  const Time woken = clock.now();
  clock.wait_until(woken + Duration::from_ms(10'000));
  EXPECT_LT(clock.now() - woken, Duration::from_ms(5'000));
  const Time again = clock.now();
  clock.wait_until(again + Duration::from_ms(20));
  EXPECT_GE(clock.now(), again + Duration::from_ms(20)) << "two wakes are one";
  clock.wait_until(Time::never());  // past: at once
}

}  // namespace
}  // namespace plumb
