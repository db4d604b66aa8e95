// For LD_PRELOAD: counts what each thread of a program takes from the heap and says it at the program's end, so that
// the process that flies is judged as it is. "heap calls of thread NAME: COUNT", by the names that the system's lists
// have; of a thread that calls never there is no line.

#include <pthread.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <cstdio>
#include <cstring>

namespace {

constexpr std::size_t kMaxThreads = 32;
constexpr std::size_t kNameBytes = 16;

struct Caller {
  char name[kNameBytes];
  std::uint64_t calls;
};

// No constructor: the first calls come before any runs.
std::array<Caller, kMaxThreads> g_callers;
std::atomic_flag g_taken = ATOMIC_FLAG_INIT;

void count_heap_call() {
  char name[kNameBytes] = "?";
  pthread_getname_np(pthread_self(), name, sizeof name);
  while (g_taken.test_and_set(std::memory_order_acquire)) {
  }
  for (Caller& caller : g_callers) {
    if (caller.calls == 0) std::memcpy(caller.name, name, sizeof name);
    if (std::strcmp(caller.name, name) != 0) continue;
    ++caller.calls;
    break;
  }
  g_taken.clear(std::memory_order_release);
}

__attribute__((destructor)) void tell() {
  for (const Caller& caller : g_callers) {
    if (caller.calls == 0) break;
    char line[80];
    const int size = std::snprintf(line, sizeof line, "heap calls of thread %s: %llu\n", caller.name,
                                   static_cast<unsigned long long>(caller.calls));
    if (size > 0 && write(STDOUT_FILENO, line, static_cast<std::size_t>(size)) < 0) return;
  }
}

}  // namespace

#include "tools/replay/heap_entry_points.inl"
