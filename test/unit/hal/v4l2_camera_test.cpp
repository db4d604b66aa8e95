// V4l2Camera through the system calls of real Video4Linux devices: frames of v4l2loopback byte for byte, and vivid, the
// kernel's own test driver, single- and multi-planar, unplugged and plugged in again.

#include "hal/linux/v4l2_camera.h"

#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <set>
#include <string>

#include "hal/linux/monotonic_clock.h"
#include "test/emulators/ov7251/loopback_camera.h"
#include "test/unit/hal/kernel_part.h"

namespace plumb {
namespace {

using emulator::LoopbackCamera;

constexpr Duration kPatience = Duration::from_ms(5000);
constexpr const char* kVivid = "/dev/video0";
constexpr const char* kVividMultiPlanar = "/dev/video1";

std::unique_ptr<V4l2Camera> open_camera(const std::string& device) {
  std::string error;
  std::unique_ptr<V4l2Camera> camera = V4l2Camera::open({.device = device}, error);
  EXPECT_NE(camera, nullptr) << error;
  return camera;
}

void write_to(const std::string& file, const std::string& text) {
  std::ofstream stream(file);
  stream << text << std::flush;
  EXPECT_TRUE(stream) << file;
}

// As it comes, vivid stamps the end of a frame that it has not reached yet.
void stamp_start_of_exposure(const char* device) {
  DeviceFile file;
  ASSERT_EQ(file.open(device), 0);
  v4l2_queryctrl control{};
  do {
    control.id |= V4L2_CTRL_FLAG_NEXT_CTRL;
    ASSERT_EQ(file.call(VIDIOC_QUERYCTRL, &control), 0) << "no control of the stamps";
  } while (std::string(reinterpret_cast<const char*>(control.name)) != "Timestamp Source");
  std::int32_t value = 1;
  ASSERT_EQ(write_control(file, control.id, value), 0);
}

void set_control(const char* device, std::uint32_t id, std::int32_t value) {
  DeviceFile file;
  EXPECT_EQ(file.open(device), 0);
  EXPECT_EQ(write_control(file, id, value), 0);
}

std::int32_t read_control(const char* device, std::uint32_t id) {
  DeviceFile file;
  v4l2_control control{.id = id, .value = -1};
  EXPECT_EQ(file.open(device), 0);
  EXPECT_EQ(file.call(VIDIOC_G_CTRL, &control), 0);
  return control.value;
}

TEST(V4l2Camera, SaysWhatIsNoCamera) {
  std::string error;
  EXPECT_EQ(V4l2Camera::open({.device = "/dev/nonsense-video"}, error), nullptr);
  EXPECT_NE(error.find("/dev/nonsense-video: cannot be opened as a camera: No such file"), std::string::npos) << error;
  EXPECT_EQ(V4l2Camera::open({.device = "/dev/null"}, error), nullptr);
  EXPECT_NE(error.find("/dev/null: cannot be opened as a camera"), std::string::npos) << error;
}

TEST(KernelV4l2Camera, HandsOverFramesByteForByte) {
  PLUMB_NEEDS_KERNEL("v4l2loopback");
  LoopbackCamera source;
  const auto camera = open_camera(LoopbackCamera::kDevice);
  ASSERT_NE(camera, nullptr);
  // Until the first image is there the device streams nothing; the port tries again by itself.
  ASSERT_NE(camera->start({}).status(), Status::kInvalidValue);
  std::set<std::int64_t> seen;
  const Time deadline = clock_now() + kPatience * 4;
  while (seen.size() < 30 && clock_now() < deadline) {
    const Result<PortFrame> frame = camera->receive(Duration::from_ms(100));
    if (!frame) continue;
    const std::int64_t index = source.index_of(frame->image);
    ASSERT_GE(index, 0) << "no image that was sent";
    EXPECT_TRUE(seen.insert(index).second) << "twice: " << index;
    EXPECT_EQ(frame->stamp, CameraStamp::kArrival);  // this driver does not say by which clock it stamps
    EXPECT_LE(frame->t, clock_now());
  }
  EXPECT_EQ(seen.size(), 30U);
  EXPECT_EQ(camera->format(), GreyFormat::kGrey);
  EXPECT_EQ(camera->health().stamps_mended, camera->health().received);
}

TEST(KernelV4l2Camera, StreamsFromSingleAndMultiPlanarDrivers) {
  PLUMB_NEEDS_KERNEL("vivid");
  for (const char* device : {kVivid, kVividMultiPlanar}) {
    SCOPED_TRACE(device);
    stamp_start_of_exposure(device);
    const auto camera = open_camera(device);
    ASSERT_NE(camera, nullptr);
    EXPECT_EQ(camera->receive(Duration()).status(), Status::kOutOfOrder);
    ASSERT_TRUE(camera->start({}));
    Time last = Time::never();
    for (int i = 0; i < 6; ++i) {
      const Result<PortFrame> frame = camera->receive(kPatience);
      ASSERT_TRUE(frame);
      EXPECT_EQ(frame->image.width, 640);
      EXPECT_EQ(frame->image.height, 480);
      EXPECT_EQ(frame->stamp, CameraStamp::kStartOfExposure);  // by CLOCK_MONOTONIC
      EXPECT_LE(frame->t, clock_now());
      EXPECT_GT(frame->t, last);
      last = frame->t;
    }
    EXPECT_EQ(camera->health().stamps_mended, 0U);
    EXPECT_EQ(camera->health().malformed, 0U);
    // It has a gain and no exposure. Then the gain stays too.
    set_control(device, V4L2_CID_AUTOGAIN, 0);
    set_control(device, V4L2_CID_GAIN, 50);
    EXPECT_EQ(camera->set_exposure({.time = Duration::from_ms(5), .gain = 2.0}).status(), Status::kRejected);
    EXPECT_EQ(camera->last_error(), EINVAL);
    EXPECT_EQ(read_control(device, V4L2_CID_GAIN), 50);
    EXPECT_EQ(camera->start({.width = 641}).status(), Status::kInvalidValue);
    ASSERT_TRUE(camera->start({}));
    EXPECT_TRUE(camera->receive(kPatience));
  }
}

// Any control that is 0 or 1 will do for the trigger.
TEST(KernelV4l2Camera, TellsTheDriverOfTheTrigger) {
  PLUMB_NEEDS_KERNEL("vivid");
  const auto start = [](std::uint32_t control, CameraTrigger trigger) {
    std::string error;
    const auto camera = V4l2Camera::open({.device = kVivid, .trigger_control = control}, error);
    return camera != nullptr && camera->start({.trigger = trigger});
  };
  const auto is_on = [] { return read_control(kVivid, V4L2_CID_HFLIP); };
  EXPECT_FALSE(start(0, CameraTrigger::kExternal)) << "no control for it";
  EXPECT_TRUE(start(V4L2_CID_HFLIP, CameraTrigger::kExternal));
  EXPECT_EQ(is_on(), 1);
  EXPECT_TRUE(start(V4L2_CID_HFLIP, CameraTrigger::kFreeRun));
  EXPECT_EQ(is_on(), 0);
}

TEST(KernelV4l2Camera, WaitsNoLongerThanItSays) {
  PLUMB_NEEDS_KERNEL("vivid");
  const auto camera = open_camera(kVivid);
  ASSERT_NE(camera, nullptr);
  ASSERT_TRUE(camera->start({.period = Duration::from_ms(1000)}));
  while (camera->receive(Duration())) {
  }
  const Time before = clock_now();
  (void)camera->receive(Duration::from_ms(20));
  EXPECT_LT(clock_now() - before, Duration::from_ms(500));
}

TEST(KernelV4l2Camera, ComesBackAfterItWasUnplugged) {
  PLUMB_NEEDS_KERNEL("vivid");
  const auto camera = open_camera(kVivid);
  ASSERT_NE(camera, nullptr);
  ASSERT_TRUE(camera->start({}));
  ASSERT_TRUE(camera->receive(kPatience));
  write_to("/sys/bus/platform/drivers/vivid/unbind", "vivid.0");
  const Time away = clock_now();
  bool went = false;
  while (clock_now() - away < Duration::from_ms(3000)) {
    if (camera->receive(Duration::from_ms(50)).status() == Status::kRejected) went = true;
  }
  EXPECT_TRUE(went);
  write_to("/sys/bus/platform/drivers/vivid/bind", "vivid.0");
  const Time back = clock_now();
  Result<PortFrame> frame = Status::kNotReady;
  while (!frame && clock_now() - back < kPatience) frame = camera->receive(Duration::from_ms(50));
  ASSERT_TRUE(frame);
  EXPECT_GT(frame->t, back);
  EXPECT_EQ(camera->health().restarts, 1U);
}

}  // namespace
}  // namespace plumb
