#include "hal/linux/realtime_thread.h"

#include <malloc.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstring>

namespace plumb {
namespace {

constexpr unsigned char kPaint = 0xA5;
constexpr std::size_t kGuardBytes = 16384;  // whole pages of any size that ARM or x86 boards use

cpu_set_t only(int core) {
  cpu_set_t cores;
  CPU_ZERO(&cores);
  CPU_SET(static_cast<unsigned>(core), &cores);
  return cores;
}

}  // namespace

std::string lock_memory() {
  if (mlockall(MCL_CURRENT | MCL_FUTURE) == 0) return {};
  return std::string("memory is not locked: ") + std::strerror(errno) + "; a page fault may delay a tick";
}

void limit_thread_memory(std::size_t stack_bytes) {
  mallopt(M_ARENA_MAX, 1);
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  pthread_attr_setstacksize(&attributes, stack_bytes);
  pthread_setattr_default_np(&attributes);
  pthread_attr_destroy(&attributes);
}

// The system alone knows all that keeps a process from a core, so it is asked to try.
bool may_run_on(int core) {
  if (core < 0 || core >= CPU_SETSIZE) return false;
  cpu_set_t before;
  if (sched_getaffinity(0, sizeof before, &before) != 0) return false;
  const cpu_set_t cores = only(core);
  if (sched_setaffinity(0, sizeof cores, &cores) != 0) return false;
  sched_setaffinity(0, sizeof before, &before);
  return true;
}

int cores_of_host() { return static_cast<int>(sysconf(_SC_NPROCESSORS_CONF)); }

RealtimeThread::~RealtimeThread() {
  join();
  if (stack_ != nullptr) munmap(stack_ - kGuardBytes, kGuardBytes + options_.stack_bytes);
}

bool RealtimeThread::start(const ThreadOptions& options, Entry entry, void* context,
                           std::vector<std::string>& warnings) {
  options_ = options;
  entry_ = entry;
  context_ = context;
  // Without access at first, and the guard for good: a stack that overflows ends the process instead of something
  // else, and where memory is locked the guard takes none.
  void* mapping =
      mmap(nullptr, kGuardBytes + options.stack_bytes, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_STACK, -1, 0);
  if (mapping == MAP_FAILED) return false;
  stack_ = static_cast<unsigned char*>(mapping) + kGuardBytes;
  if (mprotect(stack_, options.stack_bytes, PROT_READ | PROT_WRITE) != 0) return false;
  std::memset(stack_, kPaint, options.stack_bytes);
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  pthread_attr_setstack(&attributes, stack_, options.stack_bytes);
  // pthreads want a function that returns something; ours do not.
  const auto run = [](void* argument) -> void* {
    auto& thread = *static_cast<RealtimeThread*>(argument);
    thread.entry_(thread.context_);
    rusage usage{};
    getrusage(RUSAGE_THREAD, &usage);
    thread.page_faults_ = usage.ru_minflt + usage.ru_majflt;
    return nullptr;
  };
  const std::string name(options.name);
  int error = pthread_create(&thread_, &attributes, run, this);
  pthread_attr_destroy(&attributes);
  if (error != 0) return false;
  running_ = true;
  pthread_setname_np(thread_, options.name);
  if (options.priority > 0) {
    const sched_param parameter{.sched_priority = options.priority};
    error = pthread_setschedparam(thread_, SCHED_FIFO, &parameter);
    if (error != 0) warnings.push_back(name + ": no real-time priority: " + std::strerror(error));
  }
  if (options.core >= 0) {
    const cpu_set_t cores = only(options.core);
    error = pthread_setaffinity_np(thread_, sizeof cores, &cores);
    if (error != 0)
      warnings.push_back(name + ": not on core " + std::to_string(options.core) + ": " + std::strerror(error));
  }
  return true;
}

void RealtimeThread::join() {
  if (running_) pthread_join(thread_, nullptr);
  running_ = false;
}

std::size_t RealtimeThread::stack_used() const {
  if (stack_ == nullptr) return 0;
  std::size_t untouched = 0;
  while (untouched < options_.stack_bytes && stack_[untouched] == kPaint) ++untouched;
  return options_.stack_bytes - untouched;
}

}  // namespace plumb
