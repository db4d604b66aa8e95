#include "fsw/estimator/imu_buffer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "test/support/property.h"

namespace plumb {
namespace {

const Vec3 kGyroOffset(0.1, -0.2, 0.3);
const Vec3 kGyroSlope(0.5, 0.4, -0.7);
const Vec3 kAccelOffset(1.0, 2.0, 9.8);
const Vec3 kAccelSlope(-3.0, 0.2, 5.0);

/// Gyro and accelerometer that are linear in time.
ImuSample linear_sample(Time t) {
  ImuSample s;
  s.t = t;
  Eigen::Map<Vec3>(s.gyro_rad_s.data()) = kGyroOffset + kGyroSlope * t.seconds();
  Eigen::Map<Vec3>(s.accel_m_s2.data()) = kAccelOffset + kAccelSlope * t.seconds();
  return s;
}

Time ms(double t) { return Time::from_ns(static_cast<std::int64_t>(t * 1e6)); }

std::vector<ImuInterval> intervals(const ImuBuffer& imu, Time from, Time to) {
  std::vector<ImuInterval> out;
  imu.for_each_interval(from, to, [&](const ImuInterval& i) { out.push_back(i); });
  return out;
}

void expect_linear(const InertialRates& rates, double t_s) {
  EXPECT_LT((rates.gyro_rad_s - kGyroOffset - kGyroSlope * t_s).norm(), 1e-12);
  EXPECT_LT((rates.accel_m_s2 - kAccelOffset - kAccelSlope * t_s).norm(), 1e-11);
}

/// Samples at uneven times, about `count` of them, a millisecond or so apart.
std::unique_ptr<ImuBuffer> uneven_buffer(test::Generator& g, int count) {
  auto imu = std::make_unique<ImuBuffer>();
  Time t = ms(5.0);
  for (int k = 0; k < count; ++k) {
    EXPECT_EQ(imu->push(linear_sample(t)), Status::kOk);
    t = t + Duration::from_us(g.integer(100, 3000));
  }
  return imu;
}

TEST(ImuBuffer, StartsEmpty) {
  const auto imu = std::make_unique<ImuBuffer>();
  EXPECT_TRUE(imu->empty());
  EXPECT_EQ(imu->oldest(), Time::never());
  EXPECT_EQ(imu->newest(), Time::never());
  EXPECT_FALSE(imu->spans(ms(0), ms(0)));
  EXPECT_EQ(imu->statistics(ms(0), ms(1)).count, 0U);
}

TEST(ImuBuffer, RefusesWhatIsNotAfterTheNewest) {
  const auto imu = std::make_unique<ImuBuffer>();
  EXPECT_EQ(imu->push(linear_sample(ms(10))), Status::kOk);
  EXPECT_EQ(imu->push(linear_sample(ms(10))), Status::kOutOfOrder);
  EXPECT_EQ(imu->push(linear_sample(ms(9))), Status::kOutOfOrder);
  EXPECT_EQ(imu->size(), 1U);
}

TEST(ImuBuffer, WhenFullTheOldestMakesRoom) {
  const auto imu = std::make_unique<ImuBuffer>();
  const std::size_t count = 2 * ImuBuffer::kCapacity + 321;
  for (std::size_t k = 0; k < count; ++k) {
    ASSERT_EQ(imu->push(linear_sample(ms(1.0 * static_cast<double>(k)))), Status::kOk);
    ASSERT_EQ(imu->newest(), ms(1.0 * static_cast<double>(k)));
    ASSERT_EQ(imu->size(), std::min(k + 1, ImuBuffer::kCapacity));
  }
  EXPECT_EQ(imu->oldest(), ms(1.0 * static_cast<double>(count - ImuBuffer::kCapacity)));
  EXPECT_FALSE(imu->spans(imu->oldest() - Duration::from_ns(1), imu->newest()));
  EXPECT_FALSE(imu->spans(imu->oldest(), imu->newest() + Duration::from_ns(1)));
  // Across the seam of the ring the samples still stand in order.
  const auto all = intervals(*imu, imu->oldest(), imu->newest());
  ASSERT_EQ(all.size(), ImuBuffer::kCapacity - 1);
  double t_s = imu->oldest().seconds();
  for (const ImuInterval& i : all) {
    expect_linear(i.start, t_s);
    t_s += i.dt_s;
    expect_linear(i.end, t_s);
  }
}

TEST(ImuBuffer, IntervalsAreContiguousAndCutExactly) {
  test::for_all(100, [](test::Generator& g) {
    const auto imu = uneven_buffer(g, 60);
    const std::int64_t span = (imu->newest() - imu->oldest()).ns();
    const Time a = imu->oldest() + Duration::from_ns(g.integer(0, span));
    const Time b = imu->oldest() + Duration::from_ns(g.integer(0, span));
    const Time from = std::min(a, b);
    const Time to = std::max(a, b);
    ASSERT_TRUE(imu->spans(from, to));
    double t_s = from.seconds();
    const auto all = intervals(*imu, from, to);
    for (std::size_t k = 0; k < all.size(); ++k) {
      EXPECT_GT(all[k].dt_s, 0.0);
      EXPECT_LE(all[k].dt_s, 0.0031);
      expect_linear(all[k].start, t_s);
      t_s += all[k].dt_s;
      expect_linear(all[k].end, t_s);
      if (k > 0) {
        EXPECT_EQ(all[k].start.gyro_rad_s, all[k - 1].end.gyro_rad_s);
      }
    }
    EXPECT_NEAR(t_s, to.seconds(), 1e-12);
  });
}

/// Samples every `period_ms`, of which some are missing after one second.
std::vector<ImuInterval> with_samples_missing(double period_ms, int missing) {
  const auto imu = std::make_unique<ImuBuffer>();
  for (double t_ms = 0.0; t_ms < 1500.0; t_ms += period_ms) {
    const bool lost = t_ms > 1000.0 && t_ms < 1000.0 + period_ms * (missing + 0.5);
    if (lost) continue;
    EXPECT_EQ(imu->push(linear_sample(ms(t_ms))), Status::kOk);
  }
  return intervals(*imu, imu->oldest(), imu->newest());
}

// Slow is not broken: a sensor of 50 Hz leaves 20 ms between samples all the time.
TEST(ImuBuffer, AHoleIsWhatIsLongerThanUsual) {
  struct Case {
    double period_ms;
    int missing;
    double hole_s;
  };
  for (const Case& c : {Case{0.5, 15, 0.0}, Case{0.5, 99, 0.04}, Case{4.0, 1, 0.0}, Case{4.0, 4, 0.01},
                        Case{10.0, 1, 0.0}, Case{10.0, 2, 0.01}, Case{20.0, 0, 0.0}, Case{20.0, 3, 0.04}}) {
    SCOPED_TRACE(std::to_string(c.period_ms) + " ms, missing " + std::to_string(c.missing));
    double longest_s = 0.0;
    for (const ImuInterval& i : with_samples_missing(c.period_ms, c.missing)) {
      longest_s = std::max(longest_s, i.hole_s);
      EXPECT_NEAR(i.dt_s, i.hole_s > 0.0 ? i.period_s / 8.0 : i.period_s, 1e-9);
    }
    EXPECT_NEAR(longest_s, c.hole_s, 1e-9);
  }
}

TEST(ImuBuffer, AHoleAfterAnotherIsAHoleToo) {
  const auto imu = std::make_unique<ImuBuffer>();
  for (const double t_ms : {0.0, 4.0, 8.0, 58.0, 62.0, 66.0, 116.0, 120.0}) {
    EXPECT_EQ(imu->push(linear_sample(ms(t_ms))), Status::kOk);
  }
  double holes_s = 0.0;
  for (const ImuInterval& i : intervals(*imu, imu->oldest(), imu->newest())) {
    holes_s += i.hole_s / 8.0;  // each in as many parts
  }
  EXPECT_NEAR(holes_s, 2 * 0.04, 1e-9);
}

TEST(ImuBuffer, IsUnbrokenSinceTheLastHole) {
  const auto imu = std::make_unique<ImuBuffer>();
  for (const double t_ms : {0.0, 4.0, 104.0, 108.0, 112.0}) {
    EXPECT_EQ(imu->push(linear_sample(ms(t_ms))), Status::kOk);
  }
  const Duration gap = Duration::from_ms(50);
  EXPECT_EQ(imu->unbroken_since(ms(4.0), gap), ms(0.0));
  EXPECT_EQ(imu->unbroken_since(ms(50.0), gap), ms(104.0));  // in the hole
  EXPECT_EQ(imu->unbroken_since(ms(104.0), gap), ms(104.0));
  EXPECT_EQ(imu->unbroken_since(ms(112.0), gap), ms(104.0));
  EXPECT_EQ(imu->unbroken_since(ms(112.0), Duration::from_ms(100)), ms(0.0));
}

TEST(ImuBuffer, NoTimeIsNoInterval) {
  test::for_all(1, [](test::Generator& g) {
    const auto imu = uneven_buffer(g, 20);
    EXPECT_TRUE(intervals(*imu, ms(9), ms(9)).empty());
    EXPECT_TRUE(intervals(*imu, ms(9), ms(8)).empty());
    EXPECT_TRUE(intervals(*imu, imu->newest(), imu->newest()).empty());
  });
}

TEST(ImuBuffer, DropBeforeKeepsWhatIntegrationNeeds) {
  test::for_all(100, [](test::Generator& g) {
    const auto imu = uneven_buffer(g, 60);
    const Time t = imu->oldest() + Duration::from_ns(g.integer(0, (imu->newest() - imu->oldest()).ns()));
    const auto before = intervals(*imu, t, imu->newest());
    imu->drop_before(t);
    EXPECT_TRUE(imu->spans(t, imu->newest()));
    const auto after = intervals(*imu, t, imu->newest());
    ASSERT_EQ(after.size(), before.size());
    for (std::size_t k = 0; k < after.size(); ++k) {
      EXPECT_EQ(after[k].start.gyro_rad_s, before[k].start.gyro_rad_s);
      EXPECT_EQ(after[k].dt_s, before[k].dt_s);
    }
    if (imu->size() > 1) {
      EXPECT_GE(imu->oldest() + Duration::from_us(3000), t);  // and nothing else
    }
  });
}

TEST(ImuBuffer, TheHashEndsAtItsTime) {
  const auto hash_of = [](double third, Time until) {
    ImuBuffer buffer;
    for (int k = 0; k < 3; ++k) {
      ImuSample sample{.t = Time::from_ns(k), .gyro_rad_s = {}, .accel_m_s2 = {0.0, 0.0, k == 2 ? third : 9.8}};
      EXPECT_EQ(buffer.push(sample), Status::kOk);
    }
    Hash64 hash;
    buffer.add_to(hash, until);
    return hash.value();
  };
  EXPECT_EQ(hash_of(1.0, Time::from_ns(1)), hash_of(2.0, Time::from_ns(1)));
  EXPECT_NE(hash_of(1.0, Time::from_ns(2)), hash_of(2.0, Time::from_ns(2)));
}

TEST(ImuBuffer, StatisticsAreMeanAndDeviationOfTheSpan) {
  test::for_all(100, [](test::Generator& g) {
    const auto imu = std::make_unique<ImuBuffer>();
    const Time from = ms(20);
    const Time to = ms(60);
    const Vec3 offset = g.normal_vector<3>(10.0);
    std::vector<Vec3> gyro;
    std::vector<Vec3> accel;
    for (int k = 0; k < 80; ++k) {
      ImuSample s;
      s.t = ms(k);
      const Vec3 w = offset + g.normal_vector<3>(0.1);
      const Vec3 a = 3.0 * offset + g.normal_vector<3>(1.0);
      Eigen::Map<Vec3>(s.gyro_rad_s.data()) = w;
      Eigen::Map<Vec3>(s.accel_m_s2.data()) = a;
      ASSERT_EQ(imu->push(s), Status::kOk);
      if (s.t < from || s.t > to) continue;
      gyro.push_back(w);
      accel.push_back(a);
    }
    const auto mean = [](const std::vector<Vec3>& v) {
      Vec3 sum = Vec3::Zero();
      for (const Vec3& x : v) sum += x;
      return Vec3(sum / static_cast<double>(v.size()));
    };
    const auto deviation = [&mean](const std::vector<Vec3>& v) {
      double sum = 0.0;
      for (const Vec3& x : v) sum += (x - mean(v)).squaredNorm();
      return std::sqrt(sum / static_cast<double>(v.size()));
    };
    const ImuStatistics s = imu->statistics(from, to);
    EXPECT_EQ(s.count, 41U);
    EXPECT_LT((s.mean_gyro_rad_s - mean(gyro)).norm(), 1e-12);
    EXPECT_LT((s.mean_accel_m_s2 - mean(accel)).norm(), 1e-12);
    EXPECT_NEAR(s.gyro_deviation_rad_s, deviation(gyro), 1e-9);
    EXPECT_NEAR(s.accel_deviation_m_s2, deviation(accel), 1e-9);
  });
}

}  // namespace
}  // namespace plumb
