// The thread that takes images, beside a camera daemon on a real Unix socket.

#include <gtest/gtest.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "hal/include/no_sink.h"
#include "hal/linux/frame_socket.h"
#include "hal/linux/linux_clock.h"
#include "process/device_tasks.h"
#include "test/emulators/ov7251/camera_daemon.h"
#include "test/support/temporary_folder.h"

namespace plumb::test {
namespace {

// Kalibr's shift is added to a stamp, whoever worked out the middle of the exposure: the driver of the sensor or, for a
// camera that does as it likes, this thread.
TEST(CameraTask, StampsImagesByTheClockOfTheImu) {
  for (const bool is_ov7251 : {false, true}) {
    SCOPED_TRACE(is_ov7251);
    const TemporaryFolder folder;
    const std::string path = (folder.path() / "camera").string();
    emulator::CameraDaemon daemon(path);
    std::string error;
    const std::unique_ptr<FrameSocket> port = FrameSocket::open(path, error);
    ASSERT_NE(port, nullptr) << error;
    CameraSetup setup;
    setup.is_ov7251 = is_ov7251;
    setup.shift = Duration::from_us(-4250);
    const CameraCalibration camera{.width = 640, .height = 480};
    const auto rings = std::make_unique<SensorRings>();
    LinuxClock clock;
    NoSink log;
    CameraTask task(*port, setup, camera, *rings, clock, log);
    StoredImage image;
    constexpr int kMostTurns = 400;  // of 50 ms at most
    for (int i = 0; i < kMostTurns && !rings->images.pop(image); ++i) task.run_once();
    const auto sent = daemon.sent();
    const std::uint8_t* const pixels = rings->pixels[image.slot].data();
    const auto found = std::find_if(sent.begin(), sent.end(), [pixels](const emulator::Ov7251Image& candidate) {
      const auto grey = as_grey(candidate);
      return std::equal(grey.begin(), grey.end(), pixels);
    });
    ASSERT_NE(found, sent.end());
    // The readout of a camera that is none in particular is not known here.
    const std::int64_t readout_ns = is_ov7251 ? 0 : found->end_of_frame_ns - found->end_of_exposure_ns;
    const Time expected = Time::from_ns(found->middle_ns() + readout_ns) + setup.shift;
    EXPECT_LE(std::abs((image.reference.t_exposure_mid - expected).ns()), emulator::Ov7251Emulator::kLine_ns);
  }
}

TEST(CameraTask, HandsTriggerAndExposureToTheCamera) {
  const TemporaryFolder folder;
  const std::string path = (folder.path() / "camera").string();
  emulator::CameraDaemon daemon(path);
  std::string error;
  const CameraCalibration camera{.width = 640, .height = 480};
  LinuxClock clock;
  NoSink log;
  constexpr int kMostTurns = 400;
  const auto fly = [&](const CameraSetup& setup, double fill_per_ms, std::uint64_t images) {
    daemon.with([&](auto& sensor, auto&) { sensor.set_scene(fill_per_ms); });
    const std::unique_ptr<FrameSocket> port = FrameSocket::open(path, error);
    const auto rings = std::make_unique<SensorRings>();
    CameraTask task(*port, setup, camera, *rings, clock, log);
    StoredImage image;
    for (int i = 0; i < kMostTurns && task.images() < images; ++i) {
      task.run_once();
      if (rings->images.pop(image)) static_cast<void>(rings->empty.push(image.slot));
    }
    EXPECT_GE(task.images(), images);
    return daemon.sent().back();
  };
  const auto time_of = [](const emulator::Ov7251Image& image) {
    return Duration::from_ns(image.exposure_lines * emulator::Ov7251Emulator::kLine_ns);
  };
  const Duration line = Duration::from_ns(emulator::Ov7251Emulator::kLine_ns);
  CameraSetup setup;
  setup.rate_hz = 90.0;
  setup.longest_exposure = Duration::from_ms(3);
  setup.target_brightness = 40.0;
  for (const bool is_ov7251 : {false, true}) {
    for (const CameraTrigger trigger : {CameraTrigger::kFreeRun, CameraTrigger::kExternal}) {
      setup.is_ov7251 = is_ov7251;
      setup.trigger = trigger;
      const emulator::Ov7251Image image = fly(setup, 0.001, 8);
      EXPECT_EQ(daemon.trigger(), trigger == CameraTrigger::kExternal ? 1 : 0);
      if (!is_ov7251) continue;
      EXPECT_LE(time_of(image), setup.longest_exposure);
      EXPECT_GT(time_of(image) + line, setup.longest_exposure) << "in the dark";
    }
  }
  double sum = 0.0;
  for (const std::uint16_t pixel : fly(setup, 0.2, 40).pixels) sum += pixel / 4.0;
  EXPECT_NEAR(sum / (640 * 480), setup.target_brightness, setup.target_brightness * (ov7251::kBand - 1.0));
  // What is fixed is so as it stands, however long.
  setup.rate_hz = 30.0;
  setup.exposure = Duration::from_ms(15);
  const emulator::Ov7251Image fixed = fly(setup, 0.01, 8);
  EXPECT_LE(time_of(fixed), setup.exposure);
  EXPECT_GT(time_of(fixed) + line, setup.exposure);
  EXPECT_EQ(fixed.gain, 16);
}

constexpr std::size_t index_of(std::string_view counter) {
  for (std::size_t i = 0; i < kCameraFaults.size(); ++i) {
    if (kCameraFaults[i].name == counter) return i;
  }
  return kCameraFaults.size();
}

// As often as it goes, and each reason once, however often the camera is looked for.
TEST(CameraTask, TellsOnceWhyTheCameraIsAway) {
  const TemporaryFolder folder;
  const std::string path = (folder.path() / "camera").string();
  auto daemon = std::make_unique<emulator::CameraDaemon>(path);
  std::string error;
  const std::unique_ptr<FrameSocket> port = FrameSocket::open(path, error);
  ASSERT_NE(port, nullptr) << error;
  const CameraCalibration camera{.width = 640, .height = 480};
  const auto rings = std::make_unique<SensorRings>();
  LinuxClock clock;
  NoSink log;
  CameraTask task(*port, {}, camera, *rings, clock, log);
  constexpr int kMostTurns = 400;  // of 50 ms at most
  const auto gone = [&task] { return task.faults()[index_of("gone")]; };
  const auto sees_images = [&] {
    const std::uint64_t before = task.images();
    for (int i = 0; i < kMostTurns && task.images() == before; ++i) {
      task.run_once();
      StoredImage image;
      if (rings->images.pop(image)) static_cast<void>(rings->empty.push(image.slot));
    }
    return task.images() > before;
  };
  ASSERT_TRUE(sees_images());
  EXPECT_EQ(gone().count, 0U);
  for (int times = 1; times <= 2; ++times) {
    daemon.reset();
    std::filesystem::remove(path);
    const std::uint64_t before = gone().count;
    for (int i = 0; i < kMostTurns && gone().count < before + 2; ++i) task.run_once();
    const std::uint64_t told = gone().count;
    EXPECT_EQ(told, before + 2) << "the other side has closed, and then there is no such socket";
    EXPECT_EQ(gone().value, ENOENT);
    for (int i = 0; i < 10; ++i) task.run_once();
    EXPECT_EQ(gone().count, told) << "it is told already";
    daemon = std::make_unique<emulator::CameraDaemon>(path);
    EXPECT_TRUE(sees_images());
    EXPECT_EQ(gone().count, told);
  }
}

}  // namespace
}  // namespace plumb::test
