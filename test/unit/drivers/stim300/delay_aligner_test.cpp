#include "drivers/stim300/delay_aligner.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "test/support/property.h"

namespace plumb::stim300 {
namespace {

// Motion that is linear in time is joined exactly: gyro and accelerometer tell of the instant of the stamp.
TEST(Stim300DelayAligner, JoinsLinearMotionExactly) {
  test::for_all(300, [](test::Generator& g) {
    const Duration gyro_delay = Duration::from_us(g.integer(0, 30'000));
    const Duration accel_delay = Duration::from_us(g.integer(0, 30'000));
    const std::int64_t period_us = 500 * (std::int64_t{1} << g.integer(0, 4));
    const double slope = g.uniform(-10.0, 10.0);
    DelayAligner aligner(gyro_delay, accel_delay);
    const Duration difference = std::max(gyro_delay, accel_delay) - std::min(gyro_delay, accel_delay);
    const Duration unit_ahead = Duration::from_ms(g.integer(-1000, 1000));
    int samples = 0;
    for (std::int64_t i = 0; i < 100; ++i) {
      const Time t = Time::from_ns(0) + Duration::from_us(i * period_us);
      const double gyro = slope * (t - gyro_delay).seconds();
      const double accel = slope * (t - accel_delay).seconds();
      const Result<ImuSample> sample =
          aligner.push({.t = t, .gyro_rad_s = {gyro, 0, -gyro}, .accel_m_s2 = {accel, 1, -accel}}, t + unit_ahead);
      ASSERT_EQ(sample.has_value(), Duration::from_us(i * period_us) >= difference) << i;
      if (!sample) continue;
      ++samples;
      ASSERT_EQ(sample->t, t - std::max(gyro_delay, accel_delay));
      const double expected = slope * sample->t.seconds();
      ASSERT_NEAR(sample->gyro_rad_s[0], expected, 1e-9);
      ASSERT_NEAR(sample->gyro_rad_s[2], -expected, 1e-9);
      ASSERT_NEAR(sample->accel_m_s2[0], expected, 1e-9);
      ASSERT_EQ(sample->accel_m_s2[1], 1);
    }
    ASSERT_GT(samples, 35);
  });
}

// A host that was away stamps late, and when it learns so its stamps come closer together: nothing of that is motion.
TEST(Stim300DelayAligner, JoinsByTheUnitsTimeWhateverTheStamps) {
  const Duration gyro_delay = Duration::from_us(2200);
  const Duration accel_delay = Duration::from_us(6300);
  constexpr double kSlope = 3.0;
  DelayAligner aligner(gyro_delay, accel_delay);
  for (std::int64_t i = 0; i < 100; ++i) {
    const Time t_unit = Time::from_ns(0) + Duration::from_ms(4 * i);
    const Duration late = Duration::from_us(i < 50 ? 50'000 : std::max<std::int64_t>(0, 50'000 - 3900 * (i - 49)));
    const double gyro = kSlope * (t_unit - gyro_delay).seconds();
    const double accel = kSlope * (t_unit - accel_delay).seconds();
    const Result<ImuSample> sample =
        aligner.push({.t = t_unit + late, .gyro_rad_s = {gyro, 0, 0}, .accel_m_s2 = {accel, 0, 0}}, t_unit);
    if (!sample) continue;
    ASSERT_NEAR(sample->gyro_rad_s[0], sample->accel_m_s2[0], 1e-12) << i;
    ASSERT_EQ(sample->t, t_unit + late - accel_delay);
  }
}

TEST(Stim300DelayAligner, DoesNotInterpolateOverAGap) {
  DelayAligner aligner(Duration::from_us(2200), Duration::from_us(6300));
  const auto push = [&aligner](std::int64_t ms) {
    const Time t = Time::from_ns(ms * 1'000'000);
    return aligner.push({.t = t}, t).status();
  };
  EXPECT_EQ(push(0), Status::kNotReady);
  EXPECT_EQ(push(4), Status::kNotReady);
  EXPECT_EQ(push(8), Status::kOk);
  EXPECT_EQ(push(28), Status::kOk);  // 20 ms are bridged
  EXPECT_EQ(push(49), Status::kNotReady);
  EXPECT_EQ(push(53), Status::kNotReady);
  EXPECT_EQ(push(57), Status::kOk);
}

}  // namespace
}  // namespace plumb::stim300
