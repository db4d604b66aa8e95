#include "fsw/app/nav_system.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <memory>
#include <vector>

#include "tools/replay/heap_counter.h"

namespace plumb {
namespace {

using System = NavSystem<PaperConfig>;
constexpr std::int64_t kTick_ns = 4'000'000;

// Remembers which images it was given, and what was in them.
class RecordingTracker final : public Tracker<PaperConfig::kMaxTracks> {
 public:
  Status track(const CameraFrame& frame, const MotionPrediction&, FeatureFrame<PaperConfig::kMaxTracks>& out) override {
    sequences.push_back(frame.sequence);
    first_pixels.push_back(frame.image.pixels[0]);
    last_pixels.push_back(frame.image.pixels[(frame.image.height - 1) * frame.image.stride + frame.image.width - 1]);
    out.t = frame.t_exposure_mid;
    out.sequence = frame.sequence;
    out.observations.clear();
    return answer;
  }
  void use(const TrackerOptions& options) override { used = options; }
  void reset() override {}

  TrackerOptions used;

  Status answer = Status::kOk;
  std::vector<std::uint32_t> sequences;
  std::vector<std::uint8_t> first_pixels;
  std::vector<std::uint8_t> last_pixels;
};

// Which stages were entered, in order.
class RecordingObserver final : public StageObserver {
 public:
  void enter(Stage stage) override { entered.push_back(stage); }
  void leave(Stage) override {}
  std::vector<Stage> entered;
};

class NavSystemTest : public ::testing::Test {
 protected:
  NavSystemTest() {
    calibration_.camera = {.width = 64, .height = 48, .fx = 50.0, .fy = 50.0, .cx = 31.5, .cy = 23.5};
    calibration_.sensor.focal_px = 50.0;
    calibration_.sensor.half_fov_x = 0.6;
    calibration_.sensor.half_fov_y = 0.5;
    tracker_.sequences.reserve(1000);
    tracker_.first_pixels.reserve(1000);
    tracker_.last_pixels.reserve(1000);
    observer_.entered.reserve(10000);
    system_ = std::make_unique<System>(calibration_, Parameters{}, tracker_, &observer_);
    pixels_.resize(static_cast<std::size_t>(kStride) * 48, 7);
    image_ = {.pixels = pixels_.data(), .width = 64, .height = 48, .stride = kStride};
  }

  void start_with_a_state() {
    NavState truth;
    truth.t = Time::from_ns(0);
    truth.valid = true;
    system_->start_from(truth);
  }

  // A tick with the IMU at rest up to t_imu_ns (5 ms apart, from where the last tick stopped).
  InputFrame tick(std::int64_t number, std::int64_t t_imu_ns) {
    InputFrame frame;
    frame.tick = static_cast<std::uint64_t>(number);
    frame.t = Time::from_ns(number * kTick_ns);
    for (; t_next_imu_ns_ <= t_imu_ns; t_next_imu_ns_ += 5'000'000) {
      const ImuSample sample{.t = Time::from_ns(t_next_imu_ns_), .gyro_rad_s = {}, .accel_m_s2 = {0.0, 0.0, 9.80665}};
      EXPECT_EQ(frame.imu.push_back(sample), Status::kOk);
    }
    return frame;
  }
  static void add_camera(InputFrame& frame, std::int64_t t_ns, std::uint32_t sequence) {
    frame.has_camera = true;
    frame.camera = {.t_exposure_mid = Time::from_ns(t_ns), .sequence = sequence};
  }

  static constexpr std::int32_t kStride = 70;
  Calibration calibration_;
  RecordingTracker tracker_;
  RecordingObserver observer_;
  std::unique_ptr<System> system_;
  std::vector<std::uint8_t> pixels_;
  ImageView image_;
  std::int64_t t_next_imu_ns_ = 0;
};

TEST_F(NavSystemTest, ProcessesAnImageOnceTheImuReachesIt) {
  InputFrame input = tick(5, 20'000'000);
  add_camera(input, 20'000'000, 1);
  const NavTick& done = system_->step(input, &image_);
  EXPECT_TRUE(done.image.processed);
  EXPECT_EQ(done.image.t, Time::from_ns(20'000'000));
  EXPECT_EQ(done.image.sequence, 1U);
  EXPECT_EQ(tracker_.sequences, std::vector<std::uint32_t>{1});
  ASSERT_FALSE(observer_.entered.empty());
  EXPECT_EQ(observer_.entered.front(), Stage::kFrontEnd);
}

TEST_F(NavSystemTest, AWaitingImageIsKeptWhenItsBufferIsReused) {
  pixels_.front() = 11;
  pixels_[47 * kStride + 63] = 12;
  InputFrame input = tick(5, 15'000'000);
  add_camera(input, 19'000'000, 1);
  EXPECT_FALSE(system_->step(input, &image_).image.processed);
  std::fill(pixels_.begin(), pixels_.end(), std::uint8_t{99});
  EXPECT_TRUE(system_->step(tick(6, 20'000'000), nullptr).image.processed);
  EXPECT_EQ(tracker_.first_pixels, std::vector<std::uint8_t>{11});
  EXPECT_EQ(tracker_.last_pixels, std::vector<std::uint8_t>{12});
}

TEST_F(NavSystemTest, AnImageThatComesWhileOneWaitsIsSkippedAndCounted) {
  InputFrame input = tick(5, 15'000'000);
  add_camera(input, 19'000'000, 1);
  system_->step(input, &image_);
  InputFrame second = tick(6, 15'000'000);
  add_camera(second, 23'000'000, 2);
  system_->step(second, &image_);
  EXPECT_TRUE(system_->step(tick(7, 25'000'000), nullptr).image.processed);
  EXPECT_FALSE(system_->step(tick(8, 30'000'000), nullptr).image.processed);
  EXPECT_EQ(tracker_.sequences, std::vector<std::uint32_t>{1});
  EXPECT_EQ(system_->counters().frames, 2U);
  EXPECT_EQ(system_->counters().frames_skipped, 1U);
}

TEST_F(NavSystemTest, BothImagesOfATickThatEndsAWaitAreUsedOneTickApart) {
  InputFrame input = tick(5, 15'000'000);
  add_camera(input, 19'000'000, 1);
  system_->step(input, &image_);
  InputFrame second = tick(7, 25'000'000);
  add_camera(second, 23'000'000, 2);
  EXPECT_EQ(system_->step(second, &image_).image.sequence, 1U);
  EXPECT_EQ(system_->step(tick(8, 25'000'000), nullptr).image.sequence, 2U);
  EXPECT_EQ(system_->counters().frames_skipped, 0U);
}

TEST_F(NavSystemTest, RefusesImagesThatAreNone) {
  const ImageView bad[] = {{},
                           {.pixels = pixels_.data(), .width = 64, .height = 48, .stride = 63},
                           {.pixels = pixels_.data(), .width = 100'000, .height = 48, .stride = 100'000},
                           {.pixels = pixels_.data(), .width = 64, .height = -1, .stride = 64}};
  std::int64_t number = 5;
  for (const ImageView& image : bad) {
    ++number;
    InputFrame input = tick(number, number * kTick_ns);
    add_camera(input, number * kTick_ns, static_cast<std::uint32_t>(number));
    EXPECT_FALSE(system_->step(input, &image).image.processed);
  }
  ++number;
  InputFrame input = tick(number, number * kTick_ns);
  add_camera(input, number * kTick_ns, 1);
  EXPECT_FALSE(system_->step(input, nullptr).image.processed);
  EXPECT_EQ(system_->counters().frames_refused, 5U);
  EXPECT_TRUE(tracker_.sequences.empty());
}

TEST_F(NavSystemTest, AnImageTheTrackerRefusesGoesNoFurther) {
  tracker_.answer = Status::kInvalidValue;
  InputFrame input = tick(5, 20'000'000);
  add_camera(input, 20'000'000, 1);
  EXPECT_FALSE(system_->step(input, &image_).image.processed);
  EXPECT_EQ(system_->counters().frames_refused, 1U);
  EXPECT_EQ(system_->estimator().counters().frames, 0U);
}

// A clock that jumped once must not silence its sensor until that time has come.
TEST_F(NavSystemTest, RefusesWhatIsStampedAfterItsTick) {
  InputFrame input = tick(6, 24'000'000);
  const std::size_t good = input.imu.size();
  ASSERT_GT(good, 0U);
  ImuSample wrong = input.imu.back();
  wrong.t = input.t + Duration::from_ns(1);
  ASSERT_EQ(input.imu.push_back(wrong), Status::kOk);
  ASSERT_EQ(input.range.push_back({.t = wrong.t, .range_m = 3.0, .quality = RangeQuality::kValid}), Status::kOk);
  add_camera(input, 24'000'001, 1);
  const EstimatorCounters before = system_->estimator().counters();
  EXPECT_FALSE(system_->step(input, &image_).image.processed);
  EXPECT_EQ(system_->counters().samples_ahead, 2U);
  EXPECT_EQ(system_->counters().frames_refused, 1U);
  EXPECT_EQ(system_->estimator().counters().imu_samples, before.imu_samples + good);
  EXPECT_EQ(system_->estimator().counters().ranges, before.ranges);
  InputFrame next = tick(7, 28'000'000);
  add_camera(next, 24'500'000, 2);
  EXPECT_TRUE(system_->step(next, &image_).image.processed);
}

TEST_F(NavSystemTest, ACameraThatCountsFromTheStartAgainIsNotTakenForOldImages) {
  for (std::uint32_t image = 0; image < 3; ++image) {
    const std::int64_t number = 5 * (image + 1);
    InputFrame input = tick(number, number * kTick_ns);
    add_camera(input, number * kTick_ns, 0);
    EXPECT_TRUE(system_->step(input, &image_).image.processed);
    EXPECT_EQ(system_->job().features().sequence, image);
  }
}

TEST_F(NavSystemTest, RefusesATickOutOfOrderWhole) {
  system_->step(tick(5, 20'000'000), nullptr);
  const std::uint64_t samples = system_->estimator().counters().imu_samples;
  EXPECT_EQ(system_->step(tick(5, 25'000'000), nullptr).input_status, Status::kOutOfOrder);
  EXPECT_EQ(system_->estimator().counters().imu_samples, samples);
  EXPECT_EQ(system_->counters().ticks_out_of_order, 1U);
  EXPECT_EQ(system_->health().system.ticks, 2U);
}

TEST_F(NavSystemTest, KeepsBadSamplesFromThePredictor) {
  InputFrame input = tick(5, 20'000'000);
  input.imu[2].gyro_rad_s[0] = std::nan("");
  input.imu[3].accel_m_s2[1] = 1e6;  // beyond any device
  system_->step(input, nullptr);
  EXPECT_EQ(system_->estimator().counters().imu_invalid, 2U);
  EXPECT_EQ(system_->predictor().counters().refused_samples, 0U);
}

TEST_F(NavSystemTest, PredictsOneStatePerImuSampleOnceThereIsAState) {
  start_with_a_state();
  InputFrame input = tick(5, 20'000'000);
  add_camera(input, 20'000'000, 1);
  EXPECT_FALSE(system_->step(input, &image_).predicted[0].status.valid);
  ASSERT_TRUE(system_->estimator().state().valid);
  const NavTick& done = system_->step(tick(8, 32'000'000), nullptr);
  ASSERT_EQ(done.predicted.size(), 2U);
  EXPECT_EQ(done.predicted[0].t, Time::from_ns(25'000'000));
  EXPECT_EQ(done.predicted[1].t, Time::from_ns(30'000'000));
}

// The tick in which a result is handed over decides what the output is from there on, and nothing of the estimate.
TEST_F(NavSystemTest, HandsAResultOverInTheTickThatTheFrameSays) {
  start_with_a_state();
  InputFrame input = tick(5, 20'000'000);
  add_camera(input, 20'000'000, 1);
  input.handover = Handover::kHeld;
  EXPECT_TRUE(system_->step(input, &image_).image.processed);
  for (std::int64_t number = 6; number < 9; ++number) {
    input = tick(number, number * kTick_ns);
    input.handover = number == 8 ? Handover::kLate : Handover::kHeld;
    EXPECT_FALSE(system_->step(input, nullptr).predicted[0].status.valid);
  }
  EXPECT_EQ(system_->predictor().counters().corrections, 0U);
  input = tick(9, 36'000'000);
  input.handover = Handover::kReleased;
  EXPECT_EQ(system_->step(input, nullptr).predicted.size(), 1U) << "the tick's own sample is carried on already";
  EXPECT_EQ(system_->predictor().counters().corrections, 1U);
}

TEST_F(NavSystemTest, AFrameThatTheNavJobNeverGotStillCarriesTheOutputOn) {
  InputFrame input = tick(5, 20'000'000);
  system_->step(input, nullptr);
  const std::uint64_t samples = system_->estimator().counters().imu_samples;
  input = tick(6, 24'000'000);
  input.nav_missed = true;
  system_->step(input, nullptr);
  EXPECT_EQ(system_->estimator().counters().imu_samples, samples);
}

TEST_F(NavSystemTest, SaysWhetherTheOutputMayBeActedOnAndForHowLong) {
  start_with_a_state();
  InputFrame input = tick(5, 20'000'000);
  add_camera(input, 20'000'000, 1);
  system_->step(input, &image_);
  const NavTick& done = system_->step(tick(8, 32'000'000), nullptr);
  ASSERT_EQ(done.predicted.size(), 2U);
  EXPECT_TRUE(done.predicted[1].status.valid);
  EXPECT_EQ(done.predicted[1].status.mode, NavMode::kInertial) << "the tracker saw nothing";
  EXPECT_GT(done.predicted[1].status.reliable_for_s, 0.0);
  EXPECT_NEAR(done.predicted[0].status.reliable_for_s - done.predicted[1].status.reliable_for_s, 0.005, 1e-9);
  for (input = tick(9, 32'000'000); done.predicted.empty() || done.predicted[0].status.valid;) {
    ASSERT_LT(++input.tick, 200U) << "without an IMU nothing lasts";
    input.imu.clear();
    input.t = Time::from_ns(static_cast<std::int64_t>(input.tick) * kTick_ns);
    system_->step(input, nullptr);
  }
  EXPECT_EQ(done.predicted[0].status.mode, NavMode::kFailed);
  EXPECT_EQ(done.predicted[0].status.reliable_for_s, 0.0);
  ASSERT_FALSE(done.events.empty());
  EXPECT_EQ(done.events[0].id, EventId::kModeChanged);
  EXPECT_EQ(done.events[0].severity, EventSeverity::kFailure);
}

TEST_F(NavSystemTest, AResetIsCarriedOutWhenItIsAcceptedAndOnlyThen) {
  start_with_a_state();
  InputFrame input = tick(5, 20'000'000);
  add_camera(input, 20'000'000, 1);
  system_->step(input, &image_);
  ASSERT_TRUE(system_->estimator().state().valid);
  Command reset{.id = static_cast<std::uint16_t>(CommandId::kReset), .verdict = CommandVerdict::kRepeated};
  input = tick(6, 24'000'000);
  ASSERT_EQ(input.commands.push_back(reset), Status::kOk);
  system_->step(input, nullptr);
  EXPECT_TRUE(system_->estimator().state().valid);
  input = tick(7, 28'000'000);
  reset.verdict = CommandVerdict::kAccepted;
  ASSERT_EQ(input.commands.push_back(reset), Status::kOk);
  const NavTick& done = system_->step(input, nullptr);
  ASSERT_FALSE(done.events.empty());
  EXPECT_EQ(done.events[0].id, EventId::kCommand);
  EXPECT_FALSE(system_->estimator().state().valid);
  EXPECT_EQ(system_->estimator().state().reset_count, 1U);
  EXPECT_EQ(system_->counters().commanded_resets, 1U);
  EXPECT_EQ(system_->estimator().counters().resets, 1U);
}

Command set(const char* name, double value) {
  const auto number = static_cast<double>(parameter_table().find(name) - parameter_table().rows().data());
  return {.id = static_cast<std::uint16_t>(CommandId::kSetParameter),
          .arguments = {number, static_cast<double>(parameter_table_crc()), value, 0.0}};
}

TEST_F(NavSystemTest, ATimeOutThatIsSetCountsForTheModeAtOnce) {
  constexpr double kTimeout_s = 0.05;
  start_with_a_state();
  InputFrame input = tick(5, 20'000'000);
  add_camera(input, 20'000'000, 1);
  system_->step(input, &image_);
  for (std::int64_t number = 6; system_->health().status.mode != NavMode::kFailed; ++number) {
    ASSERT_LT(static_cast<double>(number * kTick_ns - 20'000'000) * 1e-9, kTimeout_s + 2e-9 * kTick_ns);
    input = {};
    input.tick = static_cast<std::uint64_t>(number);
    input.t = Time::from_ns(number * kTick_ns);
    if (number == 6) {
      ASSERT_EQ(input.commands.push_back(set("modes.imu_timeout", kTimeout_s)), Status::kOk);
    }
    system_->step(input, nullptr);
  }
  EXPECT_GT((input.t - Time::from_ns(20'000'000)).seconds(), kTimeout_s);
}

TEST_F(NavSystemTest, AParameterIsInForceEverywhereFromItsFrameOnAndIsTold) {
  InputFrame input = tick(5, 20'000'000);
  ASSERT_EQ(input.commands.push_back(set("tracker.outlier", 0.9)), Status::kOk);
  ASSERT_EQ(input.commands.push_back(set("imu.max_accel", 20.0)), Status::kOk);
  ASSERT_EQ(input.commands.push_back(set("imu.max_accel", 30.0)), Status::kOk);
  ASSERT_EQ(input.commands.push_back(set("modes.horizon", 7.0)), Status::kOk);
  input.commands[3].verdict = CommandVerdict::kRepeated;
  input.imu[0].accel_m_s2[2] = 29.0;  // by the new limit, of the same frame
  input.imu[1].accel_m_s2[2] = 31.0;
  const NavTick& done = system_->step(input, nullptr);
  EXPECT_EQ(system_->estimator().counters().imu_invalid, 1U);
  EXPECT_EQ(system_->predictor().counters().refused_samples, 0U);
  EXPECT_EQ(tracker_.used.outlier_px, 0.9);
  EXPECT_EQ(system_->job().parameters().active().modes.horizon_s, ModeOptions{}.horizon_s);
  std::vector<Event> told;
  for (const Event& event : done.events) {
    if (event.id == EventId::kParameterSet) told.push_back(event);
  }
  ASSERT_EQ(told.size(), 3U);
  EXPECT_EQ(std::bit_cast<double>(told[0].arguments[1]), TrackerOptions{}.outlier_px);
  EXPECT_EQ(std::bit_cast<double>(told[0].arguments[2]), 0.9);
  EXPECT_EQ(told[1].arguments[0], parameter_table().find("imu.max_accel") - parameter_table().rows().data());
  EXPECT_EQ(std::bit_cast<double>(told[2].arguments[1]), 20.0) << "in their order";
  EXPECT_EQ(std::bit_cast<double>(told[2].arguments[2]), 30.0);
  EXPECT_EQ(told[2].arguments[3], parameter_table_crc());
}

TEST_F(NavSystemTest, AnImageThatWasSkippedInFlightIsSkippedAgain) {
  InputFrame input = tick(5, 20'000'000);
  add_camera(input, 20'000'000, 1);
  input.image_skipped = true;
  EXPECT_FALSE(system_->step(input, &image_).image.processed);
  EXPECT_EQ(system_->counters().frames_skipped, 1U);
  EXPECT_TRUE(tracker_.sequences.empty());
}

TEST_F(NavSystemTest, NeverTouchesTheHeap) {
  if (!replay::heap_calls_counted()) GTEST_SKIP() << "the sanitizers bring their own allocator";
  static InputFrame input;
  std::uint64_t calls = 0;
  for (std::int64_t number = 1; number < 500; ++number) {
    input = tick(number, number * kTick_ns - 2'000'000);
    if (number % 12 == 0) add_camera(input, number * kTick_ns, static_cast<std::uint32_t>(number));
    const std::uint64_t before = replay::heap_calls();
    system_->step(input, &image_);
    calls += replay::heap_calls() - before;
  }
  EXPECT_EQ(calls, 0U);
  EXPECT_GT(tracker_.sequences.size(), 30U);
}

}  // namespace
}  // namespace plumb
