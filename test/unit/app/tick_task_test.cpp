#include "fsw/app/tick_task.h"

#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <string>

#include "hal/replay/replay_clock.h"
#include "tools/replay/heap_counter.h"

namespace plumb {
namespace {

class CountingSink final : public TelemetrySink, public LogSink {
 public:
  Status publish(const char*, std::span<const std::uint8_t>) override { return Status::kRejected; }
  Status write(const char* channel, Time, std::span<const std::uint8_t>) override {
    ++written[channel];
    return Status::kFull;
  }
  int last_error() const override { return 0; }
  std::map<std::string, int> written;
};

TEST(TickPacer, ATickComesWithItsSampleAndWithoutOneALittleLater) {
  const Time start = Time::from_seconds(10);
  const TickPacer pacer(start);
  EXPECT_FALSE(pacer.due(start + Duration::from_ms(1), true)) << "the rest of a burst";
  EXPECT_TRUE(pacer.due(start + Duration::from_ms(3), true));
  EXPECT_FALSE(pacer.due(start + Duration::from_ms(4), false));
  EXPECT_TRUE(pacer.due(start + Duration::from_ms(5), false));
  EXPECT_EQ(pacer.next(false), start + TickPacer::kLongest);
}

/// The tick task at 5 s on the flight clock, and all that it is connected to.
class TickTaskTest : public testing::Test {
 protected:
  static ReplayClock clock_at(Time t) {
    ReplayClock started;
    started.wait_until(t);
    return started;
  }

  std::unique_ptr<SensorRings> rings = std::make_unique<SensorRings>();
  std::unique_ptr<NavLink> link = std::make_unique<NavLink>();
  ReplayClock clock = clock_at(Time::from_seconds(5));
  CountingSink sink;
  TickTask task{{}, *rings, *link, clock, clock, sink, sink};
};

// A log that has no room and a network that takes nothing do not hold up a tick, nor does an IMU that says nothing.
TEST_F(TickTaskTest, TicksOnWithNothingButTime) {
  NavOrder order;
  task.run_once();  // the sink has seen every channel of a tick
  while (link->orders.pop(order)) {
  }
  std::uint64_t heap = 0;
  for (int i = 1; i < 1000; ++i) {
    const std::uint64_t before = replay::heap_calls();
    task.run_once();
    if (i % 250 != 3) heap += replay::heap_calls() - before;  // the sink makes rows for the channels of health
    while (link->orders.pop(order)) {
    }
  }
  EXPECT_EQ(task.gate().frame().tick, 999U);
  EXPECT_EQ(clock.now() - Time::from_seconds(5), TickPacer::kLongest * 1000);
  EXPECT_EQ(task.account(kJobAssemble).runs(), 1000U);
  EXPECT_EQ(task.account(kJobHealth).runs(), 4U);
  EXPECT_EQ(sink.written[channel::kInputFrame], 1000);
  // The queue to the nav job was emptied only after each tick, so nothing was missed; ticks of 5 ms are no slip.
  EXPECT_EQ(sink.written[channel::kEvents], 0);
  if (replay::heap_calls_counted()) {
    EXPECT_EQ(heap, 0U);
  }
}

TEST_F(TickTaskTest, TellsOfANavJobThatHangsAFewTimesAndCountsAll) {
  for (int i = 0; i < 1128; ++i) task.run_once();  // 128 fill the queue, 1000 last 5 s
  EXPECT_EQ(task.gate().counters().nav_missed, 1000U);
  EXPECT_NEAR(sink.written[channel::kEvents], JobAccount::kBurst + 4, 1);
}

}  // namespace
}  // namespace plumb
