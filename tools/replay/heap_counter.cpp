#include "tools/replay/heap_counter.h"

#include <cerrno>
#include <cstddef>

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__)
#define PLUMB_COUNT_HEAP 1
#else
#define PLUMB_COUNT_HEAP 0
#endif

namespace {
thread_local std::uint64_t t_heap_calls = 0;
}

#if PLUMB_COUNT_HEAP
// glibc's own entry points, there for exactly this purpose. operator new arrives here through malloc, and free needs no
// replacement: both sides stay glibc's.
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* block, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

void* malloc(std::size_t size) {
  ++t_heap_calls;
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  ++t_heap_calls;
  return __libc_calloc(count, size);
}
void* realloc(void* block, std::size_t size) {
  ++t_heap_calls;
  return __libc_realloc(block, size);
}
void* memalign(std::size_t alignment, std::size_t size) {
  ++t_heap_calls;
  return __libc_memalign(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  ++t_heap_calls;
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** block, std::size_t alignment, std::size_t size) {
  ++t_heap_calls;
  *block = __libc_memalign(alignment, size);
  return *block == nullptr ? ENOMEM : 0;
}
}
#endif

namespace plumb::replay {

std::uint64_t heap_calls() { return t_heap_calls; }
bool heap_calls_counted() { return PLUMB_COUNT_HEAP != 0; }

}  // namespace plumb::replay
