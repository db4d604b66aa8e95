#pragma once
// Counts the calls of the allocator made by this thread, by replacing malloc and its kin in the executable. Proof that
// the flight software does not allocate. Under the sanitizers, which bring an allocator of their own, nothing is
// counted.

#include <cstdint>

namespace plumb::replay {

/// Allocating calls (malloc, calloc, realloc, aligned_alloc, posix_memalign, memalign) of this thread so far.
std::uint64_t heap_calls();
/// False where counting is not possible; heap_calls() is then always 0.
bool heap_calls_counted();

}  // namespace plumb::replay
