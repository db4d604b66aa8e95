// Telemetry runs in flight threads: not one call of the allocator.

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "fsw/telemetry/messages.h"
#include "test/unit/telemetry/sample_records.h"
#include "tools/replay/heap_counter.h"

namespace plumb {
namespace {

TEST(TelemetryHeap, TheCounterCounts) {
  if (!replay::heap_calls_counted()) GTEST_SKIP() << "the sanitizers bring their own allocator";
  const std::uint64_t before = replay::heap_calls();
  auto block = std::make_unique<std::vector<int>>(1000);
  EXPECT_EQ(block->size(), 1000U);
  EXPECT_GE(replay::heap_calls() - before, 2U);
}

TEST(TelemetryHeap, NoEncoderOrDecoderAllocates) {
  static std::array<std::uint8_t, kMaxMessageBytes> buffer;
  static InputFrame frame = test::sample_input();
  static NavStateRecord nav = test::sample_nav_state();
  static ParamsRecord params;
  CameraCalibration camera = test::sample_camera();
  SensorCalibration sensors = test::sample_sensors();
  const std::uint8_t pixels[4] = {1, 2, 3, 4};
  CameraFrame image{.t_exposure_mid = Time::from_ns(1),
                    .sequence = 2,
                    .image = {.pixels = pixels, .width = 2, .height = 2, .stride = 2}};
  const HealthRecord health = test::sample_health();
  const TimingRecord timing = test::sample_timing();
  NavState truth = nav.state;
  bool all_ok = true;
  const auto bytes = [](const Result<std::size_t>& size) { return MessageBytes(buffer.data(), size.value()); };

  const std::uint64_t before = replay::heap_calls();
  all_ok &= ok(decode(bytes(encode(nav, buffer)), nav));
  all_ok &= ok(decode(bytes(encode(frame, buffer)), frame));
  all_ok &= ok(decode(bytes(encode(params, buffer)), params));
  all_ok &= ok(decode(bytes(encode(camera, sensors, buffer)), camera, sensors));
  all_ok &= ok(decode_truth(bytes(encode_truth(truth, buffer)), truth));
  all_ok &= ok(decode(bytes(encode(image, buffer)), image));
  all_ok &= encode(health, buffer).has_value() && encode(timing, buffer).has_value();
  all_ok &= encode(PredictedState{}, buffer).has_value();
  EXPECT_EQ(replay::heap_calls(), before);
  EXPECT_TRUE(all_ok);
}

}  // namespace
}  // namespace plumb
