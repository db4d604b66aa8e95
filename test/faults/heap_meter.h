#pragma once
// Heap calls of the flight tasks alone: test code runs them, and is called by them as clock, device and sink.

#include <cstdint>

#include "tools/replay/heap_counter.h"

namespace plumb::faults {

class HeapMeter {
 public:
  /// Of this thread, between all enter() and leave() so far. Precondition: as many of one as of the other.
  std::uint64_t calls() const { return calls_; }
  void enter() { calls_ -= replay::heap_calls(); }
  void leave() { calls_ += replay::heap_calls(); }

 private:
  std::uint64_t calls_ = 0;
};

/// All worlds of the program run in one thread.
inline HeapMeter& heap_meter() {
  static HeapMeter meter;
  return meter;
}

/// Flight code, for the length of a scope.
struct FlightScope {
  FlightScope() { heap_meter().enter(); }
  ~FlightScope() { heap_meter().leave(); }
  FlightScope(const FlightScope&) = delete;
  FlightScope& operator=(const FlightScope&) = delete;
};

/// Test code that flight code has called.
struct TestScope {
  TestScope() { heap_meter().leave(); }
  ~TestScope() { heap_meter().enter(); }
  TestScope(const TestScope&) = delete;
  TestScope& operator=(const TestScope&) = delete;
};

}  // namespace plumb::faults
