// Frames from a camera daemon over a real Unix socket: pixels, stamps, exposure, and daemons that fail.

#include "hal/linux/frame_socket.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cerrno>
#include <memory>
#include <vector>

#include "drivers/ov7251/device.h"
#include "hal/linux/monotonic_clock.h"
#include "test/emulators/ov7251/camera_daemon.h"
#include "test/support/property.h"
#include "test/support/temporary_folder.h"

namespace plumb {
namespace {

using emulator::CameraDaemon;
using emulator::Ov7251Emulator;
using emulator::Ov7251Image;
using Behaviour = CameraDaemon::Behaviour;

class FrameSocketTest : public ::testing::Test {
 protected:
  FrameSocketTest() : path_((folder_.path() / "camera").string()), daemon_(std::make_unique<CameraDaemon>(path_)) {
    camera_ = FrameSocket::open(path_, error_);
  }
  /// The sensor's image that this frame is, or null.
  const Ov7251Image* find(const PortFrame& frame) {
    sent_ = daemon_->sent();
    const auto found = std::find_if(sent_.begin(), sent_.end(),
                                    [&](const Ov7251Image& image) { return image.sequence == frame.sequence; });
    return found == sent_.end() ? nullptr : &*found;
  }

  static constexpr Duration kPatience = Duration::from_ms(20'000);
  test::TemporaryFolder folder_;
  std::string path_;
  std::unique_ptr<CameraDaemon> daemon_;
  std::string error_;
  std::unique_ptr<FrameSocket> camera_;
  std::vector<Ov7251Image> sent_;
};

TEST_F(FrameSocketTest, SaysWhereNobodyListens) {
  std::string error;
  EXPECT_EQ(FrameSocket::open("/no/such/socket", error), nullptr);
  EXPECT_NE(error.find("/no/such/socket: no camera daemon there"), std::string::npos);
}

TEST_F(FrameSocketTest, HandsOverTheSensorsPixelsStampsAndExposure) {
  ASSERT_NE(camera_, nullptr) << error_;
  EXPECT_EQ(camera_->receive(Duration()).status(), Status::kOutOfOrder);
  const Result<CameraMode> mode = camera_->start({.period = Duration::from_us(16'667)});
  ASSERT_TRUE(mode);
  EXPECT_EQ(mode->period.ns(), 862 * Ov7251Emulator::kLine_ns);
  for (int i = 0; i < 5; ++i) {
    const Result<PortFrame> frame = camera_->receive(kPatience);
    ASSERT_TRUE(frame);
    const Ov7251Image* const image = find(*frame);
    ASSERT_NE(image, nullptr);
    EXPECT_TRUE(std::equal(frame->image.pixels, frame->image.pixels + 640 * 480, as_grey(*image).begin()));
    EXPECT_EQ(frame->t.ns(), image->end_of_frame_ns);
    EXPECT_EQ(frame->stamp, CameraStamp::kEndOfFrame);
    EXPECT_EQ(frame->exposure.time.ns(), image->exposure_lines * Ov7251Emulator::kLine_ns);
  }
}

TEST_F(FrameSocketTest, WaitsNoLongerThanItSays) {
  ASSERT_TRUE(camera_->start({}));
  daemon_->with([](Ov7251Emulator& sensor, Behaviour&) { sensor.world.lose_next = 1000; });
  while (camera_->receive(Duration())) {
  }
  const Time before = clock_now();
  EXPECT_EQ(camera_->receive(Duration::from_ms(50)).status(), Status::kNotReady);
  EXPECT_GE(clock_now() - before, Duration::from_ms(50));
  EXPECT_EQ(camera_->receive(Duration()).status(), Status::kNotReady);
  daemon_->with([](Ov7251Emulator&, Behaviour& behaviour) { behaviour.answers = false; });
  EXPECT_EQ(camera_->start({}).status(), Status::kRejected);
  EXPECT_EQ(camera_->last_error(), ETIMEDOUT);
}

TEST_F(FrameSocketTest, ComesBackWithModeAndExposureAfterTheDaemonDied) {
  ASSERT_TRUE(camera_->start({}));
  ASSERT_TRUE(camera_->set_exposure({.time = Duration::from_us(2'000), .gain = 4.0}));
  ASSERT_TRUE(camera_->receive(kPatience));
  daemon_.reset();
  while (camera_->receive(Duration::from_ms(10)).status() != Status::kRejected) {
  }
  EXPECT_EQ(camera_->last_error(), ENODEV);
  EXPECT_EQ(camera_->receive(Duration::from_ms(10)).status(), Status::kRejected);
  daemon_ = std::make_unique<CameraDaemon>(path_);
  const Time deadline = clock_now() + kPatience;
  Exposure exposure;
  while (exposure.gain != 4.0 && clock_now() < deadline) {
    const Result<PortFrame> frame = camera_->receive(Duration::from_ms(10));
    if (frame) exposure = frame->exposure;
  }
  EXPECT_EQ(exposure.gain, 4.0);
  EXPECT_EQ(exposure.time.ns(), 103 * Ov7251Emulator::kLine_ns);
  EXPECT_EQ(camera_->health().restarts, 1U);
}

TEST_F(FrameSocketTest, CountsWhatIsMissingDamagedOrNoFrame) {
  ASSERT_TRUE(camera_->start({.period = Duration::from_ms(10)}));
  ASSERT_TRUE(camera_->receive(kPatience));
  daemon_->with([](Ov7251Emulator& sensor, Behaviour& behaviour) {
    sensor.world.lose_next = 2;
    sensor.world.damage_next = 1;
    behaviour.garbage = 3;
  });
  Result<PortFrame> frame = camera_->receive(kPatience);
  while (frame && !frame->damaged) frame = camera_->receive(kPatience);
  EXPECT_TRUE(frame);
  EXPECT_GE(camera_->health().missed, 2U);
  EXPECT_EQ(camera_->health().damaged, 1U);
  EXPECT_EQ(camera_->health().malformed, 3U);
}

TEST_F(FrameSocketTest, TakesTheArrivalWhereTheStampCannotBe) {
  ASSERT_TRUE(camera_->start({}));
  for (const std::int64_t error_ns : {std::int64_t{60'000'000'000}, std::int64_t{-60'000'000'000}}) {
    daemon_->with([&](Ov7251Emulator&, Behaviour& behaviour) { behaviour.stamp_error_ns = error_ns; });
    const std::uint64_t before = camera_->health().stamps_mended;
    const Time deadline = clock_now() + kPatience;
    Result<PortFrame> frame = Status::kNotReady;
    while (camera_->health().stamps_mended == before && clock_now() < deadline) frame = camera_->receive(kPatience);
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->stamp, CameraStamp::kArrival);
    EXPECT_LE(frame->t, clock_now());
    EXPECT_GE(frame->t, clock_now() - Duration::from_ms(2000));
    const std::int64_t age_ns = camera_->health().stamps_mended.value;
    EXPECT_LE(std::abs(age_ns + error_ns), 10'000'000'000) << "the age that was told";
  }
}

TEST_F(FrameSocketTest, RefusesFramesOfAnotherSize) {
  ASSERT_TRUE(camera_->start({}));
  daemon_->with([](Ov7251Emulator&, Behaviour& behaviour) { behaviour.width = 600; });
  const Time end = clock_now() + kPatience;
  while (clock_now() < end && camera_->health().malformed == 0) (void)camera_->receive(Duration::from_ms(50));
  EXPECT_GT(camera_->health().malformed, 0U);
  EXPECT_EQ(camera_->health().malformed.value, std::int64_t{600} << 32U | 480);
  EXPECT_EQ(camera_->start({}).status(), Status::kInvalidValue);
}

TEST_F(FrameSocketTest, FeedsTheDriver) {
  ov7251::Device device(*camera_, {.period = Duration::from_us(16'667)});
  ASSERT_EQ(device.start(), Status::kOk);
  for (int frames = 0; frames < 30;) {
    const Result<CameraFrame> frame = device.poll(clock_now(), kPatience);
    if (!frame) continue;
    ++frames;
    sent_ = daemon_->sent();
    const auto made = std::find_if(sent_.begin(), sent_.end(), [&](const Ov7251Image& image) {
      return std::abs(image.middle_ns() - frame->t_exposure_mid.ns()) <= 1;
    });
    EXPECT_NE(made, sent_.end());
  }
}

TEST(FrameMessage, TakesNoMessageThatSaysWhatCannotBe) {
  test::for_all(3000, [](test::Generator& g) {
    std::vector<std::uint8_t> pixels(64, 1);
    PortFrame frame{.image = {pixels.data(), 8, 8, 8},
                    .t = Time::from_ns(g.integer(0, 1'000'000)),
                    .sequence = 3,
                    .has_exposure = true,
                    .exposure = {.time = Duration::from_us(g.integer(1, 20'000)), .gain = 2.5}};
    const FrameMessage header = encode_frame(frame);
    std::vector<std::uint8_t> message(header.begin(), header.end());
    message.insert(message.end(), pixels.begin(), pixels.end());
    const Result<PortFrame> sound = decode_frame(message);
    ASSERT_TRUE(sound);
    ASSERT_EQ(sound->t, frame.t);
    ASSERT_EQ(sound->exposure, frame.exposure);
    for (int i = 0; i < 3; ++i)
      message[static_cast<std::size_t>(g.integer(0, 47))] = static_cast<std::uint8_t>(g.bits());
    message.resize(static_cast<std::size_t>(g.integer(0, static_cast<std::int64_t>(message.size()))));
    message.shrink_to_fit();
    if (!kind_of(message)) return;
    const Result<PortFrame> other = decode_frame(message);
    if (!other) return;
    ASSERT_GE(other->image.stride, other->image.width);
    ASSERT_LE(static_cast<std::size_t>(other->image.stride) * static_cast<std::size_t>(other->image.height - 1) +
                  static_cast<std::size_t>(other->image.width),
              message.size() - kFrameMessageBytes);
    ASSERT_GT(other->exposure.time, Duration());
  });
}

}  // namespace
}  // namespace plumb
