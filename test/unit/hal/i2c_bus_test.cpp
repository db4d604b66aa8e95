// The LIDAR-Lite driver through i2c-dev's system calls, with the emulated device behind a character device (CUSE).

#include "hal/linux/i2c_bus.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "drivers/lidar_lite/device.h"
#include "hal/linux/monotonic_clock.h"
#include "test/emulators/lidar_lite/lidar_lite_served.h"
#include "test/unit/hal/kernel_part.h"

namespace plumb {
namespace {

TEST(I2cBus, SaysWhichDeviceIsNotThere) {
  std::string error;
  EXPECT_EQ(LinuxI2cBus::open("/dev/nonsense-7", error), nullptr);
  EXPECT_NE(error.find("/dev/nonsense-7"), std::string::npos);
}

TEST(I2cBus, SaysWhatIsNoAdapter) {
  std::string error;
  EXPECT_EQ(LinuxI2cBus::open("/dev/null", error), nullptr);
  EXPECT_NE(error.find("is no I2C adapter"), std::string::npos);
}

#ifdef PLUMB_LIDAR_LITE_CUSE

using test::LidarLiteServed;

/// Until there are so many samples, or until the time is up: how many come is up to the machine's load.
std::vector<RangeSample> run_for(lidar_lite::Device& device, Duration duration, std::size_t wanted = SIZE_MAX) {
  std::vector<RangeSample> samples;
  const Time end = clock_now() + duration;
  while (clock_now() < end && samples.size() < wanted) {
    const Result<RangeSample> sample = device.poll(clock_now());
    if (sample) samples.push_back(*sample);
    usleep(300);
  }
  return samples;
}

TEST(KernelI2cBus, MeasuresThroughARealDevice) {
  PLUMB_NEEDS_KERNEL("CUSE (module cuse)");
  const struct {
    const char* name;
    lidar_lite::Model model;
  } models[] = {
      {"v3", lidar_lite::Model::kV3}, {"v3hp", lidar_lite::Model::kV3Hp}, {"v4led", lidar_lite::Model::kV4Led}};
  for (const auto& [name, model] : models) {
    SCOPED_TRACE(name);
    const LidarLiteServed served(PLUMB_LIDAR_LITE_CUSE, name);
    served.set("range_m 7.65");
    std::string error;
    const auto bus = LinuxI2cBus::open(LidarLiteServed::kDevice, error);
    ASSERT_NE(bus, nullptr) << error;
    lidar_lite::Device device(*bus, {.model = model});
    const Time before = clock_now();
    const std::vector<RangeSample> samples = run_for(device, Duration::from_ms(20'000), 20);
    ASSERT_EQ(samples.size(), 20U);
    for (const RangeSample& sample : samples) {
      EXPECT_EQ(sample.quality, RangeQuality::kValid);
      EXPECT_NEAR(sample.range_m, 7.65, 1e-9);
      EXPECT_GT(sample.t, before);
      EXPECT_LT(sample.t, clock_now());
    }
    served.set("dead 1");
    (void)run_for(device, Duration::from_ms(400));
    EXPECT_EQ(bus->last_error(), ENXIO);
    EXPECT_GT(device.counters().not_acknowledged, 3U);
    served.set("dead 0");
    served.set("range_m 3.21");
    const std::vector<RangeSample> again = run_for(device, Duration::from_ms(20'000), 3);
    ASSERT_EQ(again.size(), 3U);
    EXPECT_NEAR(again.back().range_m, 3.21, 1e-9);
  }
}

// As an adapter on USB that is pulled out and put back.
TEST(KernelI2cBus, MeasuresAgainWhenTheAdapterIsBack) {
  PLUMB_NEEDS_KERNEL("CUSE (module cuse)");
  std::optional<LidarLiteServed> served(std::in_place, PLUMB_LIDAR_LITE_CUSE, "v3");
  served->set("range_m 7.65");
  std::string error;
  const auto bus = LinuxI2cBus::open(LidarLiteServed::kDevice, error);
  ASSERT_NE(bus, nullptr) << error;
  lidar_lite::Device device(*bus, {.model = lidar_lite::Model::kV3});
  ASSERT_EQ(run_for(device, Duration::from_ms(20'000), 3).size(), 3U);
  EXPECT_FALSE(bus->is_gone());
  served.reset();
  EXPECT_TRUE(run_for(device, Duration::from_ms(1'000)).empty());
  EXPECT_TRUE(bus->is_gone());
  EXPECT_EQ(bus->last_error(), ENOENT) << "why it does not come back";
  served.emplace(PLUMB_LIDAR_LITE_CUSE, "v3");
  served->set("range_m 3.21");
  const std::vector<RangeSample> again = run_for(device, Duration::from_ms(20'000), 3);
  ASSERT_EQ(again.size(), 3U);
  EXPECT_NEAR(again.back().range_m, 3.21, 1e-9);
  EXPECT_FALSE(bus->is_gone());
}

TEST(KernelI2cBus, KeepsTheErrorOfATransfer) {
  PLUMB_NEEDS_KERNEL("CUSE (module cuse)");
  const LidarLiteServed served(PLUMB_LIDAR_LITE_CUSE, "v3");
  std::string error;
  const auto bus = LinuxI2cBus::open(LidarLiteServed::kDevice, error);
  ASSERT_NE(bus, nullptr) << error;
  EXPECT_EQ(bus->last_error(), 0);
  std::array<std::uint8_t, 2> bytes{0x00, 0x04};
  EXPECT_EQ(bus->write(0x42, bytes).status(), Status::kRejected) << "nobody is there";
  EXPECT_EQ(bus->last_error(), ENXIO);
  const Time before = clock_now();
  const Result<Time> stop = bus->write(0x62, bytes);
  ASSERT_TRUE(stop.has_value());
  EXPECT_GE(*stop, before);
  EXPECT_EQ(bus->read(0x62, bytes).status(), Status::kRejected) << "a read without a register";
  EXPECT_EQ(bus->write(0xFF, bytes).status(), Status::kRejected);
  EXPECT_EQ(bus->last_error(), EINVAL);
}

#else

TEST(KernelI2cBus, MeasuresThroughARealDevice) {
  PLUMB_NEEDS_KERNEL("CUSE (module cuse)");
  FAIL() << "built without libfuse3, which serves the device; expected it installed: tools/setup --tests";
}

#endif

}  // namespace
}  // namespace plumb
