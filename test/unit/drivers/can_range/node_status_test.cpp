#include "drivers/can_range/node_status.h"

#include <gtest/gtest.h>

#include "test/unit/drivers/can_range/vectors.h"

namespace plumb::can_range {
namespace {

TEST(NodeStatus, TheReferencesFrame) {
  const Time start = Time::from_ns(5);
  NodeStatusBroadcast status({.node_id = 42, .vendor_code = 0x1234}, start);
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(status.next(start + kNodeStatusPeriod * i, NodeHealth::kOk, NodeMode::kOperational).has_value());
  }
  const Result<CanFrame> frame =
      status.next(start + kNodeStatusPeriod * 3661, NodeHealth::kWarning, NodeMode::kInitialization);
  ASSERT_TRUE(frame.has_value());
  EXPECT_EQ(*frame, test::frames_of(std::array{"1001552A#4D0E0000483412C3"})[0].frame);
}

TEST(NodeStatus, OnceASecondWithTransferIdsThatCount) {
  const Time start = Time::from_ns(0);
  NodeStatusBroadcast status({}, start);
  int sent = 0;
  for (int ms = 0; ms < 70'000; ms += 4) {
    const Result<CanFrame> frame = status.next(start + Duration::from_ms(ms), NodeHealth::kOk, NodeMode::kOperational);
    if (!frame) continue;
    EXPECT_NEAR(ms, sent * 1000, 4) << "no drift";
    EXPECT_EQ(frame->bytes[7] & 0x1F, sent % 32);
    EXPECT_EQ(frame->bytes[0], sent);
    ++sent;
  }
  EXPECT_EQ(sent, 70);
}

TEST(NodeStatus, WhatWasMissedIsNotMadeUpFor) {
  const Time start = Time::from_ns(0);
  NodeStatusBroadcast status({}, start);
  const auto due = [&](int ms) {
    return status.next(start + Duration::from_ms(ms), NodeHealth::kOk, NodeMode::kOperational).has_value();
  };
  EXPECT_TRUE(due(0));
  EXPECT_TRUE(due(10'300));
  EXPECT_FALSE(due(10'301));
  EXPECT_FALSE(due(10'700));
  EXPECT_TRUE(due(11'300));
}

TEST(NodeStatusDeathTest, OptionsOutOfLimitsAreABug) {
  EXPECT_DEATH(NodeStatusBroadcast({.node_id = 0}, Time::from_ns(0)), "");
  EXPECT_DEATH(NodeStatusBroadcast({.node_id = 128}, Time::from_ns(0)), "");
  EXPECT_DEATH(NodeStatusBroadcast({.priority = 32}, Time::from_ns(0)), "");
}

}  // namespace
}  // namespace plumb::can_range
