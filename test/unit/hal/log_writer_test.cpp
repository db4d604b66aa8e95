#include "hal/linux/log_writer.h"

#include <gtest/gtest.h>

#include <cerrno>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "fsw/telemetry/executive_messages.h"
#include "plumb_lcm/plumb/log_gap_t.hpp"

namespace plumb {
namespace {

struct Written {
  std::string channel;
  std::vector<std::uint8_t> bytes;
};

class MemoryFile final : public LogSink {
 public:
  Status write(const char* channel, Time, std::span<const std::uint8_t> message) override {
    if (full) return Status::kRejected;
    records.push_back({.channel = channel, .bytes = {message.begin(), message.end()}});
    return Status::kOk;
  }
  int last_error() const override { return full ? ENOSPC : 0; }
  bool full = false;
  std::vector<Written> records;
};

class LogWriterTest : public ::testing::Test {
 protected:
  void write(QueuedLog& log, const char* channel, std::uint32_t number) {
    std::array<std::uint8_t, sizeof number> bytes{};
    std::memcpy(bytes.data(), &number, sizeof number);
    static_cast<void>(log.write(channel, Time(), bytes));
  }
  static std::uint32_t number_of(const Written& record) {
    std::uint32_t number = 0;
    std::memcpy(&number, record.bytes.data(), sizeof number);
    return number;
  }

  std::vector<std::uint8_t> storage_ = std::vector<std::uint8_t>(1 << 12);
  std::vector<std::uint8_t> tick_storage_ = std::vector<std::uint8_t>(1 << 12);
  QueuedLog device_{"device", storage_};
  QueuedLog tick_{"tick", tick_storage_};
  MemoryFile file_;
  LogWriter writer_{file_, {&device_}, tick_};
};

TEST_F(LogWriterTest, WhatATickRefersToStandsBeforeIt) {
  write(device_, "RAW", 1);
  write(tick_, "FRAME", 1);
  write(device_, "RAW", 2);
  write(tick_, "FRAME", 2);
  writer_.drain(Time());
  std::uint32_t newest_raw = 0;
  for (const Written& record : file_.records) {
    if (record.channel == "RAW") newest_raw = number_of(record);
    if (record.channel == "FRAME") {
      EXPECT_LE(number_of(record), newest_raw);
    }
  }
  EXPECT_EQ(writer_.written(), 4U);
}

// The same law with threads that do not wait for each other.
TEST_F(LogWriterTest, WhatATickRefersToStandsBeforeItWhileThreadsWrite) {
  std::atomic<std::uint32_t> handed{0};
  std::atomic<bool> over{false};
  std::jthread device([&] {
    for (std::uint32_t number = 1; !over; ++number) {
      while (device_.ring().dropped() == 0 && number > handed + 20 && !over) std::this_thread::yield();
      write(device_, "RAW", number);
      handed.store(number, std::memory_order_release);
    }
  });
  std::jthread tick([&] {
    while (!over) {
      write(tick_, "FRAME", handed.load(std::memory_order_acquire));
      std::this_thread::yield();
    }
  });
  while (file_.records.size() < 20'000) {
    writer_.drain(Time());
    std::this_thread::yield();
  }
  over = true;
  device.join();
  tick.join();
  writer_.drain(Time());
  std::uint32_t newest_raw = 0;
  bool lost = false;
  std::uint64_t wrong = 0;
  for (const Written& record : file_.records) {
    if (record.channel == "RAW") newest_raw = number_of(record);
    lost |= record.channel == channel::kLogGap;
    if (record.channel == "FRAME" && !lost && number_of(record) > newest_raw) ++wrong;
  }
  EXPECT_EQ(wrong, 0U);
}

TEST_F(LogWriterTest, MarksWhatHadNoRoom) {
  for (std::uint32_t number = 0; number < 1000; ++number) write(device_, "RAW", number);
  const std::uint64_t dropped = device_.ring().dropped();
  ASSERT_GT(dropped, 0U);
  writer_.drain(Time::from_ns(77));
  const Written& last = file_.records.back();
  ASSERT_EQ(last.channel, channel::kLogGap);
  log_gap_t gap{};
  ASSERT_GT(gap.decode(last.bytes.data(), 0, static_cast<int>(last.bytes.size())), 0);
  EXPECT_EQ(gap.records, static_cast<std::int64_t>(dropped));
  EXPECT_EQ(gap.time_ns, 77);
  EXPECT_STREQ(reinterpret_cast<const char*>(gap.queue), "device");
  const std::size_t before = file_.records.size();
  writer_.drain(Time());
  EXPECT_EQ(file_.records.size(), before) << "told once";
  EXPECT_EQ(writer_.dropped(), dropped);
}

TEST_F(LogWriterTest, AFullDiskIsCountedWithItsReasonAndSurvived) {
  file_.full = true;
  write(device_, "RAW", 1);
  writer_.drain(Time());
  EXPECT_EQ(writer_.refused(), 1U);
  EXPECT_EQ(writer_.refused().value, ENOSPC);
  EXPECT_EQ(writer_.dropped(), 0U);
}

}  // namespace
}  // namespace plumb
