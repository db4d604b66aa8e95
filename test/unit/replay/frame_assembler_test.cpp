#include "tools/replay/frame_assembler.h"

#include <gtest/gtest.h>

#include <vector>

#include "test/support/property.h"

namespace plumb::replay {
namespace {

ImuSample imu_at(std::int64_t ns) { return {.t = Time::from_ns(ns), .gyro_rad_s = {}, .accel_m_s2 = {}}; }
RangeSample range_at(std::int64_t ns) { return {.t = Time::from_ns(ns), .range_m = 1.0}; }
CameraReference camera_at(std::int64_t ns, std::uint32_t sequence) {
  return {.t_exposure_mid = Time::from_ns(ns), .sequence = sequence};
}

TEST(FrameAssembler, EndsAtOnceWithoutData) {
  FrameAssembler assembler({}, {}, {}, {});
  InputFrame frame;
  EXPECT_EQ(assembler.next(frame), Status::kNotReady);
}

TEST(FrameAssembler, CutsTicksOfFourMillisecondsFromTheFirstSample) {
  const std::vector<ImuSample> imu{imu_at(10'000'000), imu_at(14'000'000), imu_at(14'000'001), imu_at(30'000'000)};
  FrameAssembler assembler(imu, {}, {}, {});
  InputFrame frame;
  ASSERT_EQ(assembler.next(frame), Status::kOk);
  EXPECT_EQ(frame.tick, 0U);
  EXPECT_EQ(frame.t, Time::from_ns(10'000'000));
  EXPECT_EQ(frame.imu.size(), 1U);
  ASSERT_EQ(assembler.next(frame), Status::kOk);
  EXPECT_EQ(frame.tick, 1U);
  EXPECT_EQ(frame.t, Time::from_ns(14'000'000));  // a sample on the boundary belongs to the tick it ends
  EXPECT_EQ(frame.imu.size(), 1U);
  ASSERT_EQ(assembler.next(frame), Status::kOk);
  EXPECT_EQ(frame.tick, 2U);
  ASSERT_EQ(assembler.next(frame), Status::kOk);
  EXPECT_EQ(frame.tick, 5U);  // empty ticks are counted, not made
  EXPECT_EQ(frame.t, Time::from_ns(30'000'000));
  EXPECT_EQ(assembler.next(frame), Status::kNotReady);
}

TEST(FrameAssembler, PutsEverySourceOfATickTogether) {
  const std::vector<ImuSample> imu{imu_at(0), imu_at(3'000'000)};
  const std::vector<RangeSample> range{range_at(2'000'000)};
  const std::vector<CameraReference> camera{camera_at(4'000'000, 9)};
  FrameAssembler assembler(imu, range, {}, camera);
  InputFrame frame;
  ASSERT_EQ(assembler.next(frame), Status::kOk);
  EXPECT_FALSE(frame.has_camera);
  ASSERT_EQ(assembler.next(frame), Status::kOk);
  EXPECT_EQ(frame.imu.size(), 1U);
  EXPECT_EQ(frame.range.size(), 1U);
  ASSERT_TRUE(frame.has_camera);
  EXPECT_EQ(frame.camera.sequence, 9U);
  EXPECT_EQ(assembler.next(frame), Status::kNotReady);
}

TEST(FrameAssembler, TellsATickThatIsTooFull) {
  std::vector<ImuSample> imu;
  for (std::size_t i = 0; i <= kMaxImuPerFrame + 1; ++i) imu.push_back(imu_at(static_cast<std::int64_t>(i)));
  FrameAssembler crowded(imu, {}, {}, {});
  InputFrame frame;
  ASSERT_EQ(crowded.next(frame), Status::kOk);  // the first sample ends a tick of its own
  EXPECT_EQ(crowded.next(frame), Status::kFull);
  EXPECT_EQ(crowded.crowded(), Stream::kImu);
  std::vector<RangeSample> range;
  for (std::size_t i = 0; i <= kMaxRangePerFrame + 1; ++i) range.push_back(range_at(static_cast<std::int64_t>(i)));
  FrameAssembler echoes({}, range, {}, {});
  ASSERT_EQ(echoes.next(frame), Status::kOk);
  EXPECT_EQ(echoes.next(frame), Status::kFull);
  EXPECT_EQ(echoes.crowded(), Stream::kRange);
  std::vector<DirectionSample> suns;
  for (std::size_t i = 0; i <= kMaxDirectionPerFrame + 1; ++i)
    suns.push_back({.t = Time::from_ns(static_cast<std::int64_t>(i))});
  FrameAssembler bright({}, {}, suns, {});
  ASSERT_EQ(bright.next(frame), Status::kOk);
  EXPECT_EQ(bright.next(frame), Status::kFull);
  EXPECT_EQ(bright.crowded(), Stream::kDirection);
  const std::vector<CameraReference> camera{camera_at(0, 0), camera_at(1, 1), camera_at(2, 2)};
  FrameAssembler twins({}, {}, {}, camera);
  ASSERT_EQ(twins.next(frame), Status::kOk);
  EXPECT_EQ(twins.next(frame), Status::kFull);
  EXPECT_EQ(twins.crowded(), Stream::kCamera);
}

// A stamp at the end of time, centuries after the others, ends the recording like any other.
TEST(FrameAssembler, ComesToAnEndAtTheEndOfTime) {
  test::for_all(20, [](test::Generator& g) {
    constexpr std::int64_t kEnd_ns = Time::max().ns();
    const std::vector<ImuSample> imu{imu_at(g.integer(0, 10)), imu_at(kEnd_ns - g.integer(1, 2 * kTick.ns()))};
    FrameAssembler assembler(imu, {}, {}, {});
    InputFrame frame;
    for (const ImuSample& sample : imu) {
      ASSERT_EQ(assembler.next(frame), Status::kOk);
      ASSERT_EQ(frame.imu.size(), 1U);
      EXPECT_EQ(frame.imu[0].t, sample.t);
      EXPECT_GE(frame.t, sample.t);
    }
    EXPECT_EQ(assembler.next(frame), Status::kNotReady);
  });
}

// Whatever the streams: nothing is lost, added or out of order, and no tick holds what lies after its end or belongs to
// the one before.
TEST(FrameAssembler, KeepsTheTotalOrder) {
  test::for_all(200, [](test::Generator& g) {
    const std::int64_t start_ns = g.integer(0, 1'000'000'000'000'000'000);
    const auto times = [&](std::int64_t shortest_ns, std::int64_t longest_ns, int count) {
      std::vector<std::int64_t> t{start_ns + g.integer(0, 50'000'000)};
      for (int i = 1; i < count; ++i) t.push_back(t.back() + g.integer(shortest_ns, longest_ns));
      return t;
    };
    std::vector<ImuSample> imu;
    for (const std::int64_t t : times(100'000, 6'000'000, 200)) imu.push_back(imu_at(t));
    std::vector<RangeSample> range;
    for (const std::int64_t t : times(1'000'000, 60'000'000, 20)) range.push_back(range_at(t));
    std::vector<CameraReference> camera;
    for (const std::int64_t t : times(4'000'000, 60'000'000, 20)) camera.push_back(camera_at(t, 0));

    FrameAssembler assembler(imu, range, {}, camera);
    InputFrame frame;
    Time t_last = Time::never();
    std::size_t imu_seen = 0;
    std::size_t range_seen = 0;
    std::size_t camera_seen = 0;
    while (ok(assembler.next(frame))) {
      ASSERT_GT(frame.t, t_last);
      const auto inside = [&](Time t) { return t <= frame.t && t > frame.t - kTick && t > t_last; };
      for (const ImuSample& sample : frame.imu) {
        ASSERT_TRUE(inside(sample.t));
        ASSERT_EQ(sample.t, imu[imu_seen++].t);
      }
      for (const RangeSample& sample : frame.range) {
        ASSERT_TRUE(inside(sample.t));
        ASSERT_EQ(sample.t, range[range_seen++].t);
      }
      if (frame.has_camera) {
        ASSERT_TRUE(inside(frame.camera.t_exposure_mid));
        ASSERT_EQ(frame.camera.t_exposure_mid, camera[camera_seen++].t_exposure_mid);
      }
      t_last = frame.t;
    }
    EXPECT_EQ(imu_seen, imu.size());
    EXPECT_EQ(range_seen, range.size());
    EXPECT_EQ(camera_seen, camera.size());
  });
}

}  // namespace
}  // namespace plumb::replay
