#include "fsw/app/input_gate.h"

#include <gtest/gtest.h>

#include <memory>

#include "fsw/app/flight_schedule.h"
#include "test/support/property.h"

namespace plumb {
namespace {

constexpr std::uint32_t kLogical = kFlightSchedule[kJobNav].logical_ticks;

/// The gate between device threads and a nav job that the test plays.
class InputGateTest : public ::testing::Test {
 protected:
  static constexpr double kArrival_ms = 0.5;

  static Time at_ms(double ms) { return Time::from_seconds(1000.0 + 1e-3 * ms); }

  void imu(double ms) {
    ASSERT_EQ(rings_->imu.push({.sample = {.t = at_ms(ms)}, .t_arrival = at_ms(ms + kArrival_ms)}), Status::kOk);
  }
  /// The camera's thread. False: no empty slot.
  bool camera(double ms, std::uint32_t sequence) {
    std::uint8_t slot = 0;
    if (!rings_->empty.pop(slot)) return false;
    const StoredImage image{
        .reference = {.t_exposure_mid = at_ms(ms), .sequence = sequence}, .slot = slot, .width = 64, .height = 48};
    return ok(rings_->images.push(image));
  }
  /// A tick of 4 ms with an IMU sample, the nav job taking its orders.
  const InputFrame& tick(bool with_imu = true) {
    ms_ += 4.0;
    if (with_imu) imu(ms_);
    gate_.assemble(at_ms(ms_));
    gate_.order();
    NavOrder order;
    while (takes_orders_ && link_->orders.pop(order)) {
      if (order.has_image) at_work_ = order.image;
    }
    return gate_.frame();
  }
  void answer(bool has_state = true) {
    NavAnswer answer;
    answer.has_state = has_state;
    answer.slot = at_work_.slot;
    ASSERT_EQ(link_->answers.push(answer), Status::kOk);
  }

  double ms_ = 0.0;
  bool takes_orders_ = true;
  std::unique_ptr<SensorRings> rings_ = std::make_unique<SensorRings>();
  std::unique_ptr<NavLink> link_ = std::make_unique<NavLink>();
  ParameterStore parameters_{parameter_table(), {}};
  InputGate gate_{*rings_, *link_, parameters_};
  StoredImage at_work_;
};

TEST_F(InputGateTest, ReleasesAResultAfterItsLogicalExecutionTimeHoweverEarlyItIsThere) {
  camera(2.0, 7);
  EXPECT_TRUE(tick().has_camera);
  EXPECT_EQ(gate_.frame().camera.sequence, 7U);
  answer();
  for (std::uint32_t i = 1; i < kLogical; ++i) EXPECT_EQ(tick().handover, Handover::kHeld);
  EXPECT_EQ(tick().handover, Handover::kReleased);
  EXPECT_EQ(tick().handover, Handover::kHeld);
}

TEST_F(InputGateTest, ReleasesALateResultInTheTickThatFindsIt) {
  camera(2.0, 1);
  tick();
  for (std::uint32_t i = 1; i < kLogical; ++i) tick();
  EXPECT_EQ(tick().handover, Handover::kLate);
  EXPECT_EQ(tick().handover, Handover::kHeld);
  answer();
  EXPECT_EQ(tick().handover, Handover::kReleased);
  EXPECT_EQ(gate_.counters().results_late, 1U);
}

TEST_F(InputGateTest, KeepsTheArrivalOfEverySampleBesideTheFrame) {
  constexpr std::size_t kMore = 3;
  for (std::size_t i = 0; i < kMaxImuPerFrame + kMore; ++i) imu(0.1 * static_cast<double>(i));
  for (const std::size_t samples : {kMaxImuPerFrame, kMore, std::size_t{0}}) {
    const InputFrame& frame = tick(false);
    ASSERT_EQ(frame.imu.size(), samples);
    ASSERT_EQ(gate_.arrivals().size(), samples);
    for (std::size_t i = 0; i < samples; ++i) {
      EXPECT_EQ(gate_.arrivals()[i], frame.imu[i].t + Duration::from_seconds(1e-3 * kArrival_ms));
    }
  }
}

TEST_F(InputGateTest, AnImageWaitsForTheImuToReachIt) {
  camera(3.0, 1);
  EXPECT_FALSE(tick(false).has_camera);
  EXPECT_FALSE(tick(false).has_camera);
  EXPECT_TRUE(tick().has_camera);
}

TEST_F(InputGateTest, OneImageWaitsForTheNavJobAndTheNextIsSkipped) {
  camera(2.0, 1);
  tick();
  camera(5.0, 2);
  EXPECT_FALSE(tick().has_camera);
  camera(9.0, 3);
  const InputFrame& skipping = tick();
  EXPECT_TRUE(skipping.has_camera);
  EXPECT_TRUE(skipping.image_skipped);
  EXPECT_EQ(skipping.camera.sequence, 3U);
  answer();
  while (tick().handover != Handover::kReleased) {
  }
  EXPECT_TRUE(gate_.frame().has_camera) << "in the tick that frees the nav job";
  EXPECT_EQ(gate_.frame().camera.sequence, 2U);
  EXPECT_EQ(gate_.counters().images_skipped, 1U);
}

TEST_F(InputGateTest, ARefusedImageFreesTheNavJobAndReleasesNothing) {
  camera(2.0, 1);
  tick();
  answer(false);
  camera(5.0, 2);
  const InputFrame& next = tick();
  EXPECT_EQ(next.handover, Handover::kHeld);
  EXPECT_TRUE(next.has_camera);
  EXPECT_EQ(next.camera.sequence, 2U);
}

TEST_F(InputGateTest, AnImageThatWaitsForADeadImuGivesWayToANewerOne) {
  ms_ = 400.0;
  camera(100.0, 1);
  tick(false);
  camera(250.0, 2);
  EXPECT_EQ(tick(false).camera.sequence, 2U) << "not old enough";
  camera(301.0, 3);
  EXPECT_EQ(tick(false).camera.sequence, 1U);
  EXPECT_TRUE(gate_.frame().image_skipped);
}

TEST_F(InputGateTest, AnImageStampedAheadIsSkippedAtOnceAndKeepsNoOtherOut) {
  camera(1e6, 1);
  const InputFrame& skipping = tick();
  EXPECT_TRUE(skipping.image_skipped);
  EXPECT_EQ(skipping.camera.sequence, 1U);
  camera(6.0, 2);
  EXPECT_EQ(tick().camera.sequence, 2U);
  EXPECT_FALSE(gate_.frame().image_skipped);
}

TEST_F(InputGateTest, SaysWhichFramesANavJobThatHangsNeverGets) {
  takes_orders_ = false;
  while (!link_->orders.full()) EXPECT_FALSE(tick().nav_missed);
  camera(ms_, 1);
  EXPECT_TRUE(tick().nav_missed);
  EXPECT_FALSE(gate_.frame().has_camera) << "an image waits for a frame that the nav job gets";
  takes_orders_ = true;
  tick();
  EXPECT_TRUE(tick().has_camera);
}

TEST_F(InputGateTest, JudgesCommandsAndBringsThemInTheirOrder) {
  constexpr std::size_t kSent = kMaxCommandsPerFrame + 2;
  for (std::uint32_t i = 0; i < kSent; ++i) {
    ASSERT_EQ(rings_->commands.push({.source = 1, .sequence = i, .id = static_cast<std::uint16_t>(i < 3 ? 1 : 77)}),
              Status::kOk);
  }
  ASSERT_EQ(tick().commands.size(), kMaxCommandsPerFrame);
  EXPECT_TRUE(gate_.frame().commands[2].is(CommandId::kPing));
  EXPECT_EQ(gate_.frame().commands[3].verdict, CommandVerdict::kUnknown);
  ASSERT_EQ(tick().commands.size(), 2U) << "the rest in the next tick";
  EXPECT_EQ(gate_.frame().commands[1].sequence, kSent - 1);
  EXPECT_TRUE(tick().commands.empty());
}

// The second of a frame is judged by what the first leaves: alone, neither a far minimum nor a near maximum fits.
TEST_F(InputGateTest, JudgesParametersOfOneFrameOneAfterTheOther) {
  const auto set = [this](std::uint32_t sequence, const char* name, double value) {
    const auto rows = parameter_table().rows();
    const auto number = static_cast<double>(parameter_table().find(name) - rows.data());
    const Command command{.sequence = sequence,
                          .id = static_cast<std::uint16_t>(CommandId::kSetParameter),
                          .arguments = {number, static_cast<double>(parameter_table_crc()), value, 0.0}};
    ASSERT_EQ(rings_->commands.push(command), Status::kOk);
  };
  const double far_m = 2.0 * Parameters{}.estimator.range.max_range_m;
  set(1, "range.min_range", far_m);
  set(2, "range.max_range", 2.0 * far_m);
  set(3, "range.min_range", far_m);
  set(4, "range.max_range", far_m);
  ASSERT_EQ(tick().commands.size(), 4U);
  EXPECT_EQ(gate_.frame().commands[0].verdict, CommandVerdict::kConflict);
  EXPECT_EQ(gate_.frame().commands[1].verdict, CommandVerdict::kAccepted);
  EXPECT_EQ(gate_.frame().commands[2].verdict, CommandVerdict::kAccepted) << "fits what the frame has set so far";
  EXPECT_EQ(gate_.frame().commands[3].verdict, CommandVerdict::kConflict);
  set(5, "range.min_range", far_m);
  ASSERT_EQ(tick().commands.size(), 1U);
  EXPECT_EQ(gate_.frame().commands[0].verdict, CommandVerdict::kConflict) << "nobody has put them in force";
}

TEST_F(InputGateTest, ACommandWaitsForAFrameThatTheNavJobGets) {
  takes_orders_ = false;
  while (!link_->orders.full()) tick();
  ASSERT_EQ(rings_->commands.push({.id = static_cast<std::uint16_t>(CommandId::kReset)}), Status::kOk);
  EXPECT_TRUE(tick().nav_missed);
  EXPECT_TRUE(gate_.frame().commands.empty());
  takes_orders_ = true;
  tick();
  EXPECT_EQ(tick().commands.size(), 1U);
}

TEST_F(InputGateTest, TimeOfTicksIncreasesEvenWhereTheClockStands) {
  gate_.assemble(at_ms(4));
  const Time first = gate_.frame().t;
  gate_.assemble(at_ms(4));
  EXPECT_GT(gate_.frame().t, first);
}

// Whatever comes when: every image is answered for once, no slot is lost, and a result is released once, never before
// its time.
TEST_F(InputGateTest, LosesNoImageAndNoSlotWhateverComesWhen) {
  test::for_all(50, [this](test::Generator& g) {
    rings_ = std::make_unique<SensorRings>();
    link_ = std::make_unique<NavLink>();
    InputGate gate(*rings_, *link_, parameters_);
    std::uint32_t offered = 0;
    std::uint32_t sent = 0;
    std::uint32_t skipped = 0;
    std::uint32_t released = 0;
    std::uint32_t refused = 0;
    std::uint64_t sent_in = 0;
    bool working = false;
    for (std::uint64_t number = 1; number < 1500; ++number) {
      const double ms = 4.0 * static_cast<double>(number);
      if (g.integer(0, 9) > 0) imu(ms);
      if (g.integer(0, 5) == 0 && camera(ms - g.uniform(-20.0, 20.0), offered)) ++offered;
      const InputFrame& frame = gate.assemble(at_ms(ms));
      gate.order();
      if (frame.handover == Handover::kReleased) {
        ++released;
        EXPECT_GE(frame.tick - sent_in, kLogical);
      }
      if (frame.has_camera) ++(frame.image_skipped ? skipped : sent);
      NavOrder order;
      while (link_->orders.pop(order)) {
        if (!order.has_image) continue;
        EXPECT_FALSE(working) << "one image at a time";
        working = true;
        at_work_ = order.image;
        sent_in = order.input.tick;
      }
      if (working && g.integer(0, 8) == 0) {
        working = false;
        const bool has_state = g.integer(0, 3) > 0;
        if (!has_state) ++refused;
        answer(has_state);
      }
    }
    EXPECT_GT(released, 20U);
    EXPECT_LE(sent - released - refused, 1U) << "but for the one that is with the nav job or waits for its time";
    EXPECT_LE(offered - sent - skipped, SensorRings::kImageSlots);
  });
}

}  // namespace
}  // namespace plumb
