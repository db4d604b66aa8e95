#include "tools/replay/heap_counter.h"

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__)
#define PLUMB_COUNT_HEAP 1
#else
#define PLUMB_COUNT_HEAP 0
#endif

namespace {
thread_local std::uint64_t t_heap_calls = 0;
#if PLUMB_COUNT_HEAP
void count_heap_call() { ++t_heap_calls; }
#endif
}  // namespace

#if PLUMB_COUNT_HEAP
#include "tools/replay/heap_entry_points.inl"
#endif

namespace plumb::replay {

std::uint64_t heap_calls() { return t_heap_calls; }
bool heap_calls_counted() { return PLUMB_COUNT_HEAP != 0; }

}  // namespace plumb::replay
