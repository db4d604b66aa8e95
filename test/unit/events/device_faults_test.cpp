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
  counts[3] = 2;
  report.look(start, counts);
  counts[3] = 5;
  counts[8] = 1;
  report.look(start + Report::kPeriod - Duration::from_ns(1), counts);
  std::vector<DeviceFault> told = taken(ring);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].device, FaultyDevice::kCamera);
  EXPECT_EQ(told[0].counter, 3);
  EXPECT_EQ(told[0].count, 2U);
  EXPECT_EQ(told[0].before, 0U);
  report.look(start + Report::kPeriod, counts);
  told = taken(ring);
  ASSERT_EQ(told.size(), 2U);
  EXPECT_EQ(told[0].count, 5U);
  EXPECT_EQ(told[0].before, 2U);
  EXPECT_EQ(told[1].counter, 8);
}

// Whatever rises when, and however seldom the tick comes round: in the end the last word on each counter is its count,
// and each word goes on from the one before.
TEST(DeviceFaultReport, LosesNothingToARingThatIsFull) {
  std::mt19937 random(1);
  DeviceFaultRing ring;
  Report report(FaultyDevice::kCamera, ring);
  Report::Counts counts{};
  Report::Counts heard{};
  const auto listen = [&] {
    for (const DeviceFault& fault : taken(ring)) {
      EXPECT_EQ(fault.before, heard[fault.counter]);
      EXPECT_GT(fault.count, fault.before);
      heard[fault.counter] = fault.count;
    }
  };
  Time now = Time::from_ns(0);
  for (int i = 0; i < 10'000; ++i) {
    now = now + Duration::from_ms(100);
    counts[random() % counts.size()] += random() % 3;
    report.look(now, counts);
    if (random() % 100 == 0) listen();
  }
  EXPECT_GT(ring.overflows(), 0U) << "never full: the test shows nothing";
  listen();
  report.look(now + Report::kPeriod, counts);
  listen();
  EXPECT_EQ(heard, counts);
}

}  // namespace
}  // namespace plumb
