// Cameras that have exposure and gain as controls, through the kernel's own driver for them: an emulated USB camera at
// the kernel's virtual USB controller, uvcvideo, V4l2Camera, and the driver of the OV7251 on top.

#include <gtest/gtest.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "drivers/ov7251/device.h"
#include "hal/linux/monotonic_clock.h"
#include "hal/linux/v4l2_camera.h"
#include "test/emulators/uvc_camera/uvc_camera_on_usb.h"
#include "test/unit/hal/kernel_part.h"

namespace plumb {
namespace {

using emulator::UvcCamera;
using emulator::UvcCameraOnUsb;
using emulator::UvcImage;

constexpr Duration kPatience = Duration::from_ms(20'000);
constexpr Duration kUnit = Duration::from_us(100);
constexpr double kGainUnit = 1.0 / 16.0;

std::unique_ptr<V4l2Camera> open_camera(const UvcCameraOnUsb& usb) {
  std::string error;
  std::unique_ptr<V4l2Camera> camera = V4l2Camera::open({.device = usb.device()}, error);
  EXPECT_NE(camera, nullptr) << error;
  return camera;
}

UvcCamera::Settings settings_of(UvcCameraOnUsb& usb) {
  UvcCamera::Settings settings;
  usb.with([&](UvcCamera& camera) { settings = camera.settings(); });
  return settings;
}

/// The image as the camera made it: its first pixels tell its number.
UvcImage made_as(UvcCameraOnUsb& usb, const ImageView& image) {
  std::uint32_t number = 0;
  for (int i = 3; i >= 0; --i) number = number << 8U | image.pixels[i];
  UvcImage made;
  usb.with([&](UvcCamera& camera) {
    ASSERT_LT(number, camera.images().size()) << "no image that was made";
    made = camera.images()[number];
  });
  return made;
}

int wrong_pixels(const UvcImage& made, const ImageView& image) {
  int wrong = 0;
  for (int v = 0; v < image.height; ++v) {
    const std::uint8_t* const row = image.pixels + static_cast<std::ptrdiff_t>(v) * image.stride;
    for (int u = 0; u < image.width; ++u) wrong += row[u] != made.pixel(u, v) / 4 ? 1 : 0;
  }
  return wrong;
}

double mean_of(const ImageView& image) {
  std::int64_t sum = 0;
  for (int v = 0; v < image.height; ++v) {
    const std::uint8_t* const row = image.pixels + static_cast<std::ptrdiff_t>(v) * image.stride;
    for (int u = 0; u < image.width; ++u) sum += row[u];
  }
  return static_cast<double>(sum) / (image.width * image.height);
}

/// Until done(), or patience is over.
template <typename Act, typename Done>
bool act_until(Act act, Done done) {
  for (const Time start = clock_now(); !done();) {
    if (clock_now() - start > kPatience) return false;
    act();
  }
  return true;
}

bool receives(V4l2Camera& camera) {
  bool received = false;
  return act_until([&] { received = bool(camera.receive(Duration::from_ms(100))); }, [&] { return received; });
}

class KernelUvcCamera : public testing::Test {
 protected:
  void SetUp() override { PLUMB_NEEDS_KERNEL("vhci_hcd and uvcvideo"); }
};

TEST_F(KernelUvcCamera, TakesTheLightThatIsAskedForInStepsOfTimeAndGain) {
  UvcCameraOnUsb usb;
  const auto camera = open_camera(usb);
  ASSERT_NE(camera, nullptr);
  EXPECT_EQ(settings_of(usb).auto_exposure, UvcCamera::kAutomatic) << "as most such cameras begin";
  std::mt19937 random(3);
  for (int i = 0; i < 20; ++i) {
    const Exposure asked = {.time = Duration::from_us(std::uniform_int_distribution(100, 32'000)(random)),
                            .gain = std::uniform_real_distribution(1.0, 60.0)(random)};
    const Result<Exposure> taken = camera->set_exposure(asked);
    ASSERT_TRUE(taken);
    const UvcCamera::Settings got = settings_of(usb);
    EXPECT_EQ(taken->time, kUnit * got.exposure_100us);
    EXPECT_EQ(taken->gain, got.gain * kGainUnit);
    EXPECT_LE(taken->time, asked.time);
    EXPECT_GT(taken->time + kUnit, asked.time);
    const double gain = asked.gain * asked.time.seconds() / taken->time.seconds();
    EXPECT_LE(std::abs(taken->gain - std::min(gain, UvcCamera::kMostGain * kGainUnit)), kGainUnit / 2);
    EXPECT_EQ(got.auto_exposure, UvcCamera::kManual);
  }
}

TEST_F(KernelUvcCamera, TellsWhatTheCameraHoldsOfWhatItTook) {
  UvcCameraOnUsb usb;
  const auto camera = open_camera(usb);
  ASSERT_NE(camera, nullptr);
  usb.with([](UvcCamera& held) { held.world.held_step = 7; });
  for (const std::int64_t asked_us : {10'000, 3'300, 700}) {
    const Result<Exposure> taken = camera->set_exposure({.time = Duration::from_us(asked_us), .gain = 1.0});
    ASSERT_TRUE(taken);
    EXPECT_EQ(taken->time, Duration::from_us(asked_us / 700 * 700));
    EXPECT_EQ(taken->time, kUnit * settings_of(usb).exposure_100us);
  }
}

TEST_F(KernelUvcCamera, MovesWhatItHasNotIntoItsLimits) {
  UvcCameraOnUsb usb;
  const auto camera = open_camera(usb);
  ASSERT_NE(camera, nullptr);
  const Exposure least = {.time = kUnit * UvcCamera::kLeastExposure_100us, .gain = UvcCamera::kLeastGain * kGainUnit};
  const Exposure most = {.time = kUnit * UvcCamera::kMostExposure_100us, .gain = UvcCamera::kMostGain * kGainUnit};
  const Result<Exposure> below = camera->set_exposure({.time = Duration::from_us(1), .gain = 0.1});
  ASSERT_TRUE(below);
  EXPECT_EQ(*below, least);
  EXPECT_EQ(settings_of(usb).exposure_100us, UvcCamera::kLeastExposure_100us);
  const Result<Exposure> above = camera->set_exposure({.time = Duration::from_ms(60'000), .gain = 1e9});
  ASSERT_TRUE(above);
  EXPECT_EQ(*above, most);
  EXPECT_EQ(settings_of(usb).gain, UvcCamera::kMostGain);
}

TEST_F(KernelUvcCamera, StreamsGreyAndTenBitsPixelForPixel) {
  for (const auto& [pixels, format] : {std::pair(emulator::uvc::Pixels::kGrey, GreyFormat::kGrey),
                                       std::pair(emulator::uvc::Pixels::kY10, GreyFormat::kY10)}) {
    SCOPED_TRACE(static_cast<int>(format));
    UvcCameraOnUsb usb({.formats = {pixels}});
    const auto camera = open_camera(usb);
    ASSERT_NE(camera, nullptr);
    usb.with([](UvcCamera& shown) { shown.set_scene(0.12); });
    ASSERT_TRUE(camera->start({}));
    EXPECT_EQ(camera->format(), format);
    ASSERT_TRUE(camera->set_exposure({.time = Duration::from_ms(6), .gain = 1.5}));
    bool has_changed = false;
    for (int i = 0; i < 6; ++i) {
      const Result<PortFrame> frame = camera->receive(kPatience);
      ASSERT_TRUE(frame);
      const UvcImage made = made_as(usb, frame->image);
      EXPECT_EQ(made.pixels, pixels);
      EXPECT_EQ(wrong_pixels(made, frame->image), 0);
      has_changed = has_changed || made.exposure_100us == 60;
    }
    EXPECT_TRUE(has_changed) << "no image with the exposure that was set";
    EXPECT_EQ(camera->health().malformed, 0U);
    EXPECT_EQ(camera->health().damaged, 0U);
    EXPECT_EQ(camera->health().stamps_mended, 0U);
  }
}

TEST_F(KernelUvcCamera, AnExposureThatIsStalledIsToldAndLeavesTheOneBefore) {
  UvcCameraOnUsb usb;
  const auto camera = open_camera(usb);
  ASSERT_NE(camera, nullptr);
  ASSERT_TRUE(camera->start({}));
  ASSERT_TRUE(camera->set_exposure({.time = Duration::from_ms(5), .gain = 1.0}));
  usb.with([](UvcCamera& stalled) { stalled.world.stall_exposures = 1; });
  EXPECT_EQ(camera->set_exposure({.time = Duration::from_ms(8), .gain = 1.0}).status(), Status::kRejected);
  EXPECT_NE(camera->last_error(), 0);
  EXPECT_EQ(settings_of(usb).exposure_100us, 50U);
  EXPECT_TRUE(receives(*camera));
  EXPECT_TRUE(camera->set_exposure({.time = Duration::from_ms(8), .gain = 1.0}));
  EXPECT_EQ(settings_of(usb).exposure_100us, 80U);
  EXPECT_EQ(camera->health().restarts, 0U);
}

TEST_F(KernelUvcCamera, IsOfUseWithoutAnExposureControl) {
  UvcCameraOnUsb usb({.has_exposure = false});
  const auto camera = open_camera(usb);
  ASSERT_NE(camera, nullptr);
  ASSERT_TRUE(camera->start({}));
  EXPECT_EQ(camera->set_exposure({.time = Duration::from_ms(5), .gain = 2.0}).status(), Status::kRejected);
  EXPECT_EQ(camera->last_error(), EINVAL);
  EXPECT_TRUE(receives(*camera));
  ASSERT_TRUE(camera->start({}));
  EXPECT_EQ(camera->health().exposures_lost, 1U);
  EXPECT_EQ(camera->health().exposures_lost.value, EINVAL);
  EXPECT_TRUE(receives(*camera));
}

/// The driver of the sensor on that camera, and what each of its images really was.
class KernelUvcOv7251 : public KernelUvcCamera {
 protected:
  void begin(const ov7251::Options& options) {
    device_.reset();
    port_.reset();
    usb_.reset();  // there is one port for it
    usb_ = std::make_unique<UvcCameraOnUsb>();
    port_ = open_camera(*usb_);
    ASSERT_NE(port_, nullptr);
    device_ = std::make_unique<ov7251::Device>(*port_, options);
    ASSERT_EQ(device_->start(), Status::kOk);
  }
  /// Calls look(frame, image as it was made) for each image until done() or patience is over.
  bool run(const std::function<void(const CameraFrame&, const UvcImage&)>& look, const std::function<bool()>& done) {
    const auto poll = [&] {
      const Result<CameraFrame> frame = device_->poll(clock_now(), Duration::from_ms(100));
      if (frame) look(*frame, made_as(*usb_, frame->image));
    };
    return act_until(poll, done);
  }
  const ov7251::Counters& counters() const { return device_->protocol().counters(); }

  std::unique_ptr<UvcCameraOnUsb> usb_;
  std::unique_ptr<V4l2Camera> port_;
  std::unique_ptr<ov7251::Device> device_;
};

TEST_F(KernelUvcOv7251, BringsItsImagesToTheTarget) {
  begin({});
  for (const double fill_per_ms : {2.5, 0.8, 0.03}) {
    SCOPED_TRACE(fill_per_ms);
    usb_->with([&](UvcCamera& camera) { camera.set_scene(fill_per_ms); });
    const std::uint32_t changes = counters().exposures;
    std::uint32_t unknown = 0;
    int right = 0;
    const auto look = [&](const CameraFrame& frame, const UvcImage& made) {
      const bool is_own = made.exposure_100us == UvcCamera::Settings{}.exposure_100us;  // before any was set
      if (!is_own && device_->protocol().exposure().time.ns() != made.exposure_ns()) ++unknown;
      const double factor = mean_of(frame.image) / ov7251::AutoExposureOptions{}.target;
      right = made.fill_per_ms == fill_per_ms && factor < ov7251::kBand && factor > 1.0 / ov7251::kBand ? right + 1 : 0;
    };
    EXPECT_TRUE(run(look, [&] { return right >= 5; }));
    EXPECT_GT(counters().exposures, changes);
    EXPECT_LE(unknown, counters().exposures - changes) << "more than one image at each change";
  }
  EXPECT_EQ(counters().refused, 0U);
  EXPECT_GT(settings_of(*usb_).gain, UvcCamera::kLeastGain) << "the longest exposure is not enough for the dark scene";
}

// An image arrives some time after its exposure, which does not depend on how long the exposure is.
TEST_F(KernelUvcOv7251, StampsTheMiddleOfTheExposureHoweverLongItIs) {
  std::vector<std::int64_t> least_late_ns;
  for (const Duration exposure : {Duration::from_ms(1), Duration::from_ms(30)}) {
    begin({.auto_exposure = false, .exposure = {.time = exposure}, .longest_exposure = exposure});
    std::vector<std::int64_t> late_ns;
    const auto look = [&](const CameraFrame& frame, const UvcImage& made) {
      const bool acts = std::abs(made.exposure_ns() - exposure.ns()) < 2 * kUnit.ns();  // in lines, then in steps
      if (acts) late_ns.push_back(frame.t_exposure_mid.ns() - made.middle_ns());
    };
    ASSERT_TRUE(run(look, [&] { return late_ns.size() >= 12; }));
    late_ns.erase(late_ns.begin(), late_ns.begin() + 2);  // the change acts on
    least_late_ns.push_back(*std::min_element(late_ns.begin(), late_ns.end()));
    EXPECT_GE(least_late_ns.back(), 0) << "before it was";
  }
  EXPECT_LE(std::abs(least_late_ns[1] - least_late_ns[0]), Duration::from_ms(5).ns());
}

TEST_F(KernelUvcOv7251, GetsItsExposureAgainWhenItIsPluggedInAgain) {
  begin({.auto_exposure = false, .exposure = {.time = Duration::from_ms(4)}});
  std::uint32_t images = 0;
  const auto count = [&](const CameraFrame&, const UvcImage&) { ++images; };
  ASSERT_TRUE(run(count, [&] { return images >= 3; }));
  const UvcCamera::Settings before = settings_of(*usb_);
  for (const int stalls : {0, 1}) {
    SCOPED_TRACE(stalls);
    usb_->pull();
    EXPECT_EQ(device_->poll(clock_now(), Duration::from_ms(20)).status(), Status::kRejected);
    EXPECT_EQ(port_->last_error(), ENODEV);
    usb_->with([&](UvcCamera& camera) { camera.world.stall_exposures = stalls; });
    usb_->put_back();
    ASSERT_NE(settings_of(*usb_).exposure_100us, before.exposure_100us) << "it has forgotten it";
    images = 0;
    EXPECT_TRUE(run(count, [&] { return images >= 3; }));
    EXPECT_EQ(settings_of(*usb_).exposure_100us, before.exposure_100us);
    EXPECT_EQ(settings_of(*usb_).auto_exposure, UvcCamera::kManual);
    EXPECT_EQ(counters().refused, static_cast<std::uint64_t>(stalls));
  }
  EXPECT_EQ(port_->health().restarts, 2U);
}

}  // namespace
}  // namespace plumb
