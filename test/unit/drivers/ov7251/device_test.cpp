// The driver with an emulated sensor behind the port: what it says of time and exposure, against what the sensor did.

#include "drivers/ov7251/device.h"

#include <gtest/gtest.h>

#include <cerrno>
#include <cmath>
#include <vector>

#include "test/emulators/ov7251/ov7251_port.h"
#include "test/support/property.h"

namespace plumb::ov7251 {
namespace {

using emulator::Ov7251Emulator;
using emulator::Ov7251Port;

class Ov7251Device : public ::testing::Test {
 protected:
  explicit Ov7251Device() : sensor_(0, test::base_seed()), port_(sensor_) {}

  /// The camera frames of so many periods of the sensor.
  std::vector<CameraFrame> run(Device& device, int periods) {
    std::vector<CameraFrame> frames;
    errors_ns_.clear();
    const Time end = port_.now() + Duration::from_ns(sensor_.period_ns() * periods);
    while (port_.now() < end) {
      const Result<CameraFrame> frame = device.poll(port_.now(), Duration::from_ms(5));
      if (!frame) continue;
      frames.push_back(*frame);
      errors_ns_.push_back(frame->t_exposure_mid.ns() - port_.image().middle_ns());
    }
    return frames;
  }

  Ov7251Emulator sensor_;
  Ov7251Port port_;
  std::vector<std::int64_t> errors_ns_;  ///< of the stamps, frame by frame
};

TEST_F(Ov7251Device, SetsModeAndExposure) {
  Device device(port_, {.period = Duration::from_us(16'667), .auto_exposure = false});
  ASSERT_EQ(device.start(), Status::kOk);
  EXPECT_EQ(sensor_.period_ns(), 860 * Ov7251Emulator::kLine_ns);
  (void)run(device, 5);
  EXPECT_EQ(port_.image().exposure_lines, 258);  // 5 ms, rounded down to lines
  EXPECT_EQ(port_.image().gain, 16);
  EXPECT_EQ(sensor_.exposures_written(), 1);
}

TEST_F(Ov7251Device, StampsTheMiddleOfTheExposureThroughEveryChangeOfIt) {
  for (const bool tells : {false, true}) {
    for (const CameraStamp stamp : {CameraStamp::kEndOfFrame, CameraStamp::kStartOfExposure, CameraStamp::kArrival,
                                    CameraStamp::kEndOfExposure}) {
      SCOPED_TRACE(static_cast<int>(stamp));
      port_.stamp = stamp;
      port_.tells_exposure = tells;
      Device device(port_, {.arrival_delay = Duration::from_us(400)});
      ASSERT_EQ(device.start(), Status::kOk);
      for (const double fill_per_ms : {0.3, 0.02, 0.1}) {
        sensor_.set_scene(fill_per_ms);
        const std::size_t frames = run(device, 60).size();
        EXPECT_GE(frames, 59U);
        for (std::size_t i = 4; i < errors_ns_.size(); ++i) EXPECT_LE(std::abs(errors_ns_[i]), 1) << i;
      }
      EXPECT_GT(device.protocol().counters().exposures, 3U);
    }
  }
}

TEST_F(Ov7251Device, IsOffByHalfTheStepWhereARegisterActsEarlier) {
  sensor_.world.control_delay = 1;
  Device device(port_, {});
  ASSERT_EQ(device.start(), Status::kOk);
  (void)run(device, 10);
  sensor_.set_scene(0.03);
  Duration before = device.protocol().exposure().time;
  Duration longest_step;
  int off = 0;
  for (int i = 0; i < 60; ++i) {
    (void)run(device, 1);
    const Duration now = device.protocol().exposure().time;
    longest_step = std::max(longest_step, std::max(now - before, before - now));
    before = now;
    for (const std::int64_t error_ns : errors_ns_) {
      if (std::abs(error_ns) > 1) ++off;
      EXPECT_LE(std::abs(error_ns), Duration::from_us(2'500).ns());
    }
  }
  EXPECT_LE(off, static_cast<int>(device.protocol().counters().exposures));
}

TEST_F(Ov7251Device, BringsAnySceneToTheTargetAndStaysThere) {
  sensor_.set_scene([](int u, int v) { return 0.002 * (1.0 + u / 64.0) * (1.0 + v / 48.0); });
  Device device(port_, {.longest_exposure = Duration::from_us(8'000)});
  ASSERT_EQ(device.start(), Status::kOk);
  (void)run(device, 60);
  const std::uint32_t changes = device.protocol().counters().exposures;
  const std::vector<CameraFrame> frames = run(device, 60);
  EXPECT_EQ(device.protocol().counters().exposures, changes);
  EXPECT_FALSE(device.protocol().at_exposure_limit());
  double sum = 0.0;
  for (const std::uint16_t pixel : port_.image().pixels) sum += pixel / 4.0;
  EXPECT_NEAR(sum / (640 * 480), AutoExposureOptions{}.target, AutoExposureOptions{}.target * (kBand - 1.0));
  EXPECT_LE(device.protocol().exposure().time, Duration::from_us(8'000));
}

TEST_F(Ov7251Device, AsksAgainForTheExposureThatACameraCameBackWithout) {
  Device device(port_, {.auto_exposure = false});
  ASSERT_EQ(device.start(), Status::kOk);
  (void)run(device, 10);
  const int before = port_.image().exposure_lines;
  ASSERT_NE(before, Ov7251Port::kOwnExposure_lines);
  port_.lose_exposure(EILSEQ);
  (void)run(device, 10);
  EXPECT_EQ(device.protocol().counters().refused, 1U);
  EXPECT_EQ(device.protocol().counters().refused.value, EILSEQ);
  EXPECT_EQ(port_.image().exposure_lines, before);
}

TEST_F(Ov7251Device, CountsEveryFrameThatGotLost) {
  for (const bool counts_lost : {true, false}) {
    Device device(port_, {});
    sensor_.world.counts_lost = counts_lost;
    ASSERT_EQ(device.start(), Status::kOk);
    (void)run(device, 10);
    sensor_.world.lose_next = 3;
    (void)run(device, 10);
    sensor_.world.lose_next = 1;
    (void)run(device, 10);
    EXPECT_EQ(device.protocol().counters().lost, 4U);
  }
}

TEST_F(Ov7251Device, PassesNoImageOfAFrozenSensor) {
  Device device(port_, {});
  ASSERT_EQ(device.start(), Status::kOk);
  (void)run(device, 30);
  sensor_.world.frozen = true;
  EXPECT_LE(run(device, 30).size(), 1U);
  sensor_.world.frozen = false;
  EXPECT_GE(run(device, 10).size(), 9U);
}

TEST_F(Ov7251Device, GoesOnAfterTheCameraWasAway) {
  Device device(port_, {});
  ASSERT_EQ(device.start(), Status::kOk);
  (void)run(device, 30);
  port_.gone = true;
  EXPECT_TRUE(run(device, 90).empty());
  port_.gone = false;
  EXPECT_GE(run(device, 10).size(), 9U);
  for (const std::int64_t error_ns : errors_ns_) EXPECT_LE(std::abs(error_ns), 1);
  EXPECT_NEAR(static_cast<double>(device.protocol().counters().lost), 90.0, 1.0);
}

TEST_F(Ov7251Device, FliesWithACameraThatHasNoControls) {
  port_.has_controls = false;
  // The sensor's own exposure at power-on.
  Device device(port_, {.exposure = {.time = kLineTime * 504, .gain = 1.0}});
  ASSERT_EQ(device.start(), Status::kOk);
  EXPECT_GE(run(device, 30).size(), 29U);
  for (const std::int64_t error_ns : errors_ns_) EXPECT_LE(std::abs(error_ns), 1);
  EXPECT_GT(device.protocol().counters().refused, 20U);
  // What fails later, for another reason, says nothing of the refusal.
  EXPECT_EQ(device.protocol().counters().refused.value, ENOTTY);
  port_.gone = true;
  (void)port_.set_exposure({.time = kLineTime, .gain = 1.0});
  ASSERT_EQ(port_.last_error(), ENODEV);
  EXPECT_EQ(device.protocol().counters().refused.value, ENOTTY);
  EXPECT_EQ(device.protocol().counters().exposures, 0U);
}

}  // namespace
}  // namespace plumb::ov7251
