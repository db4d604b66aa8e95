#pragma once
// A thread as flight wants it: fixed priority, a core of its own, a stack whose depth is known afterwards. What the
// system does not permit is done without, and told: on a desk everything runs, only not so punctually.

#include <pthread.h>

#include <cstddef>
#include <string>
#include <vector>

namespace plumb {

/// Keeps every page of the process in memory from here on. Empty, or why that is not so.
std::string lock_memory();

/// Before the first thread. A thread that a library starts has a stack of that size: by default it has the 8 MB of
/// `ulimit -s`, and where memory is locked all of it is in memory. All threads have one heap: one for each would be
/// taken, 33 pages, in the midst of the flight when the thread first asks, which LCM does for who publishes.
void limit_thread_memory(std::size_t stack_bytes);

/// Whether the system lets a thread of this process run on that core.
bool may_run_on(int core);
int cores_of_host();

struct ThreadOptions {
  const char* name = "";  ///< at most 15 characters, for the system's lists
  int priority = 0;       ///< SCHED_FIFO, 1 to 99; 0: the system's usual scheduling
  int core = -1;          ///< that it stays on; -1: any
  std::size_t stack_bytes = std::size_t{256} << 10;
};

class RealtimeThread {
 public:
  using Entry = void (*)(void* context);

  RealtimeThread() = default;
  ~RealtimeThread();
  RealtimeThread(const RealtimeThread&) = delete;
  RealtimeThread& operator=(const RealtimeThread&) = delete;

  /// Runs entry(context) in a new thread. False when there is none; what was done without is added to `warnings`.
  bool start(const ThreadOptions& options, Entry entry, void* context, std::vector<std::string>& warnings);
  /// Waits for the thread's end.
  void join();
  /// Bytes of the stack that were ever used: the paint below them is untouched. Any time after start().
  std::size_t stack_used() const;
  /// How often the thread touched a page that was not in memory; after join().
  long page_faults() const { return page_faults_; }
  const ThreadOptions& options() const { return options_; }

 private:
  ThreadOptions options_;
  Entry entry_ = nullptr;
  void* context_ = nullptr;
  long page_faults_ = 0;
  pthread_t thread_{};
  bool running_ = false;
  unsigned char* stack_ = nullptr;
};

}  // namespace plumb
