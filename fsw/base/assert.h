#pragma once
// Assertions for bugs: a condition that no input, however bad, may break. Kept in every build.
// Faults of the world (bad data, lost sensors) are never asserted; they are a Status, a counter and a decision.

namespace plumb {

struct AssertSite {
  const char* file;
  int line;
  const char* condition;
};

using AssertHandler = void (*)(const AssertSite&);

/// Installs what is told of a broken assertion before the process stops (flight: safe the mode machine; host: print).
/// Call once at start-up; null takes it away again. With no handler the process traps. It is told of the first broken
/// assertion only, on the thread that broke it.
void set_assert_handler(AssertHandler handler);

/// Tells the handler, then traps. Called by PLUMB_ASSERT.
[[noreturn]] void assert_failed(const AssertSite& site);

}  // namespace plumb

#define PLUMB_ASSERT(condition)                                 \
  do {                                                          \
    if (!(condition)) [[unlikely]]                              \
      ::plumb::assert_failed({__FILE__, __LINE__, #condition}); \
  } while (false)
