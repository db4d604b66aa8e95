#include "hal/linux/realtime_thread.h"

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <thread>

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
  stack_of(do_little);  // the first thread finds the functions of libraries that all call, on its stack
  const std::size_t little = stack_of(do_little);
  const std::size_t more = stack_of(use_stack);
  EXPECT_GT(more, little + 18'000);
  EXPECT_LT(more, little + 24'000);
}

TEST(RealtimeThread, TellsHowOftenAPageWasNotThere) {
  constexpr std::size_t kPages = 64;
  const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  void* memory = mmap(nullptr, kPages * page, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  ASSERT_NE(memory, MAP_FAILED);
  madvise(memory, kPages * page, MADV_NOHUGEPAGE);
  const auto touch = [](void* begin) {
    const auto step = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
    for (std::size_t i = 0; i < kPages; ++i) static_cast<volatile unsigned char*>(begin)[i * step] = 1;
  };
  std::vector<std::string> warnings;
  std::array<long, 2> faults{};
  for (long& count : faults) {
    RealtimeThread thread;
    EXPECT_TRUE(thread.start({.name = "test"}, touch, memory, warnings));
    thread.join();
    count = thread.page_faults();
  }
  munmap(memory, kPages * page);
  EXPECT_GE(faults[0], static_cast<long>(kPages));
  EXPECT_LT(faults[1], static_cast<long>(kPages)) << "all pages were there";
}

TEST(RealtimeThread, ThreadsOfLibrariesHaveTheStackThatTheyAreLeft) {
  constexpr std::size_t kBytes = std::size_t{192} << 10;
  limit_thread_memory(kBytes);
  std::size_t bytes = 0;
  std::thread([&bytes] {
    pthread_attr_t attributes;
    pthread_getattr_np(pthread_self(), &attributes);
    pthread_attr_getstacksize(&attributes, &bytes);
    pthread_attr_destroy(&attributes);
  }).join();
  EXPECT_EQ(bytes, kBytes);
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
