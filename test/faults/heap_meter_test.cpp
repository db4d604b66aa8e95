#include "test/faults/heap_meter.h"

#include <gtest/gtest.h>

#include <memory>

namespace plumb::faults {
namespace {

TEST(HeapMeter, CountsWhatFlightCodeTakesAndNotWhatTestsTake) {
  if (!replay::heap_calls_counted()) GTEST_SKIP() << "the sanitizers bring their own allocator";
  const auto take = [] { static_cast<void>(std::make_unique<volatile int>(1)); };
  const std::uint64_t before = heap_meter().calls();
  take();
  EXPECT_EQ(heap_meter().calls(), before);
  {
    const FlightScope flight;
    take();
    {
      const TestScope test;
      take();
      take();
    }
    take();
  }
  EXPECT_EQ(heap_meter().calls(), before + 2);
}

}  // namespace
}  // namespace plumb::faults
