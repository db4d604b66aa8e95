// The estimator asks nobody for memory: every allocation of its thread is counted while it works.

#include <gtest/gtest.h>

#include <cstdlib>

#include "fsw/base/mission_config.h"
#include "test/support/estimator_feed.h"
#include "tools/replay/heap_counter.h"

namespace plumb {
namespace {

constexpr const char* kNotCounted = "the sanitizers bring their own allocator";

template <typename Work>
std::uint64_t heap_calls_of(Work work) {
  const std::uint64_t before = replay::heap_calls();
  work();
  return replay::heap_calls() - before;
}

/// Hands the estimator everything itself, so that nothing but the estimator runs while the heap is watched.
template <class Config>
void expect_no_heap_calls(bool start_from_truth, bool ranged_features) {
  using Feed = test::EstimatorFeed<Estimator<Config>>;
  const sim::FlightSettings settings = test::quick_settings(start_from_truth);
  Feed feed(test::lively_scene(5.0), settings);
  feed.estimator = test::estimator_with<Config>(
      settings, [=](EstimatorOptions& options) { options.range.feature = ranged_features; });
  Estimator<Config>& estimator = *feed.estimator;
  std::uint64_t calls = 0;
  feed.on_imu = [&](ImuSample& sample) {
    calls += heap_calls_of([&] { static_cast<void>(estimator.add_imu(sample)); });
    return false;
  };
  feed.on_range = [&](RangeSample& sample) {
    calls += heap_calls_of([&] { static_cast<void>(estimator.add_range(sample)); });
    return false;
  };
  feed.on_frame = [&](typename Feed::Frame& frame) {
    const double t_s = (frame.t - sim::flight_epoch()).seconds();
    if (t_s > 3.0 && t_s < 3.5) frame.observations.clear();
    calls += heap_calls_of([&] { static_cast<void>(estimator.process(frame)); });
    return false;
  };
  feed.fly_until(4.0);
  EXPECT_TRUE(estimator.state().valid);
  const EstimatorCounters& counters = estimator.counters();
  EXPECT_GT(ranged_features ? counters.ranges_feature : counters.ranges_used, 10U);
  calls += heap_calls_of([&] { estimator.reset(); });
  feed.fly_until(5.0);
  EXPECT_EQ(calls, 0U);
}

TEST(NoHeap, TheCounterCounts) {
  if (!replay::heap_calls_counted()) GTEST_SKIP() << kNotCounted;
  EXPECT_GE(heap_calls_of([] {
              // volatile: the compiler may not leave the pair out
              void* volatile p = std::malloc(100);
              std::free(p);
              int* volatile q = new int(1);
              delete q;
            }),
            2U);
}

TEST(NoHeap, TheEstimatorMakesNoHeapCall) {
  if (!replay::heap_calls_counted()) GTEST_SKIP() << kNotCounted;
  expect_no_heap_calls<PaperConfig>(true, false);
  expect_no_heap_calls<FlightConfig>(false, true);
}

}  // namespace
}  // namespace plumb
