// The estimator asks nobody for memory: every allocation of this program is counted while it works.

#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>

#include "fsw/base/mission_config.h"
#include "test/support/estimator_feed.h"

#if defined(__SANITIZE_ADDRESS__)
#define PLUMB_CAN_COUNT_HEAP_CALLS 0  // the sanitizer needs malloc for itself
#else
#define PLUMB_CAN_COUNT_HEAP_CALLS 1
#endif

namespace {
std::atomic<bool> g_watching{false};
std::atomic<int> g_calls{0};

void count() {
  if (g_watching.load(std::memory_order_relaxed)) g_calls.fetch_add(1, std::memory_order_relaxed);
}
}  // namespace

#if PLUMB_CAN_COUNT_HEAP_CALLS
// operator new ends in malloc, so that these see everything.
extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);

void* malloc(std::size_t size) {
  count();
  return __libc_malloc(size);
}
void* calloc(std::size_t n, std::size_t size) {
  count();
  return __libc_calloc(n, size);
}
void* realloc(void* p, std::size_t size) {
  count();
  return __libc_realloc(p, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  count();
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** out, std::size_t alignment, std::size_t size) {
  count();
  *out = __libc_memalign(alignment, size);
  return *out == nullptr ? 12 : 0;
}
}
#endif

namespace plumb {
namespace {

template <typename Work>
int heap_calls(Work work) {
  g_calls = 0;
  g_watching = true;
  work();
  g_watching = false;
  return g_calls;
}

/// Hands the estimator everything itself, so that nothing but the estimator runs while the heap is watched.
template <class Config>
void expect_no_heap_calls(bool start_from_truth) {
  using Feed = test::EstimatorFeed<Estimator<Config>>;
  Feed feed(test::lively_scene(5.0), test::quick_settings(start_from_truth));
  Estimator<Config>& estimator = *feed.estimator;
  int calls = 0;
  feed.on_imu = [&](ImuSample& sample) {
    calls += heap_calls([&] { static_cast<void>(estimator.add_imu(sample)); });
    return false;
  };
  feed.on_range = [&](RangeSample& sample) {
    calls += heap_calls([&] { static_cast<void>(estimator.add_range(sample)); });
    return false;
  };
  feed.on_frame = [&](typename Feed::Frame& frame) {
    const double t_s = (frame.t - sim::flight_epoch()).seconds();
    if (t_s > 3.0 && t_s < 3.5) frame.observations.clear();
    calls += heap_calls([&] { static_cast<void>(estimator.process(frame)); });
    return false;
  };
  feed.fly_until(4.0);
  EXPECT_TRUE(estimator.state().valid);
  EXPECT_GT(estimator.counters().ranges_used, 10U);
  calls += heap_calls([&] { estimator.reset(); });
  feed.fly_until(5.0);
  EXPECT_EQ(calls, 0);
}

TEST(NoHeap, TheCounterCounts) {
  if (!PLUMB_CAN_COUNT_HEAP_CALLS) GTEST_SKIP() << "not under the address sanitizer";
  EXPECT_GE(heap_calls([] {
              // volatile: the compiler may not leave the pair out
              void* volatile p = std::malloc(100);
              std::free(p);
              int* volatile q = new int(1);
              delete q;
            }),
            2);
}

TEST(NoHeap, TheEstimatorMakesNoHeapCall) {
  if (!PLUMB_CAN_COUNT_HEAP_CALLS) GTEST_SKIP() << "not under the address sanitizer";
  expect_no_heap_calls<PaperConfig>(true);
  expect_no_heap_calls<FlightConfig>(false);
}

}  // namespace
}  // namespace plumb
