#include "fsw/events/device_faults.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace plumb {
namespace {

using Report = DeviceFaultReport<kCameraFaults.size()>;

std::vector<DeviceFault> taken(DeviceFaultRing& ring) {
  std::vector<DeviceFault> faults;
  for (DeviceFault fault; ring.pop(fault);) faults.push_back(fault);
  return faults;
}

TEST(DeviceFaultReport, TellsTheFirstAtOnceAndThenOnceASecondWhatHasRisen) {
  DeviceFaultRing ring;
  Report report(FaultyDevice::kCamera, ring);
  Report::Counts counts{};
  const Time start = Time::from_ns(7'000'000'000);
  report.look(start, counts);
  EXPECT_TRUE(taken(ring).empty()) << "all is well";
  counts[3] = {2, 640};
  report.look(start, counts);
  counts[3].add(-7, 3);
  counts[8] = 1;
  report.look(start + Report::kPeriod - Duration::from_ns(1), counts);
  std::vector<DeviceFault> told = taken(ring);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].device, FaultyDevice::kCamera);
  EXPECT_EQ(told[0].counter, 3);
  EXPECT_EQ(told[0].count, 2U);
  EXPECT_EQ(told[0].count.value, 640);
  report.look(start + Report::kPeriod, counts);
  told = taken(ring);
  ASSERT_EQ(told.size(), 2U);
  EXPECT_EQ(told[0].count, 5U);
  EXPECT_EQ(told[0].count.value, -7);
  EXPECT_EQ(told[1].counter, 8);
}

// Whatever rises when, and however seldom the tick comes round: each word tells more than the one before, and in the
// end the last word on each counter is its count and value.
TEST(DeviceFaultReport, LosesNothingToARingThatIsFull) {
  std::mt19937 random(1);
  DeviceFaultRing ring;
  Report report(FaultyDevice::kCamera, ring);
  Report::Counts counts{};
  Report::Counts heard{};
  const auto listen = [&] {
    for (const DeviceFault& fault : taken(ring)) {
      EXPECT_GT(fault.count, heard[fault.counter]);
      heard[fault.counter] = fault.count;
    }
  };
  Time now = Time::from_ns(0);
  for (int i = 0; i < 10'000; ++i) {
    now = now + Duration::from_ms(100);
    if (const std::uint64_t more = random() % 3; more > 0) counts[random() % counts.size()].add(i, more);
    report.look(now, counts);
    if (random() % 100 == 0) listen();
  }
  EXPECT_GT(ring.overflows(), 0U) << "never full: the test shows nothing";
  listen();
  report.look(now + Report::kPeriod, counts);
  listen();
  for (std::size_t i = 0; i < counts.size(); ++i) {
    EXPECT_EQ(heard[i].count, counts[i].count);
    EXPECT_EQ(heard[i].value, counts[i].value);
  }
}

}  // namespace
}  // namespace plumb
