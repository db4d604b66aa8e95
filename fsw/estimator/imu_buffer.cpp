#include "fsw/estimator/imu_buffer.h"

#include <cmath>

namespace plumb {

Status ImuBuffer::push(const ImuSample& sample) {
  if (!empty() && sample.t <= newest()) return Status::kOutOfOrder;
  if (count_ == kCapacity) {
    first_ = (first_ + 1) % kCapacity;
    --count_;
  }
  samples_[(first_ + count_) % kCapacity] = sample;
  ++count_;
  return Status::kOk;
}

void ImuBuffer::drop_before(Time t) {
  while (count_ >= 2 && at(1).t <= t) {
    first_ = (first_ + 1) % kCapacity;
    --count_;
  }
}

Duration ImuBuffer::hole_before(std::size_t sample) const {
  constexpr Duration kNever = Duration::from_ms(10);  // no hole up to here, whatever the rate
  constexpr std::size_t kUsual = 8;                   // periods before it that tell what is usual
  if (sample < 2 || at(sample).t - at(sample - 1).t <= kNever) return Duration::from_ns(0);
  std::array<Duration, kUsual> periods;
  const std::size_t count = std::min(sample - 1, kUsual);
  for (std::size_t k = 0; k < count; ++k) periods[k] = at(sample - 1 - k).t - at(sample - 2 - k).t;
  std::sort(periods.begin(), periods.begin() + static_cast<std::ptrdiff_t>(count));
  const Duration twice = periods[count / 2] * 2;  // the median: another hole among them is not usual
  return std::max(at(sample).t - at(sample - 1).t - std::max(twice, kNever), Duration::from_ns(0));
}

Time ImuBuffer::unbroken_since(Time to, Duration gap) const {
  std::size_t since = 0;
  for (std::size_t i = 0; i + 1 < count_ && at(i).t < to; ++i) {
    if (at(i + 1).t - at(i).t > gap) since = i + 1;
  }
  return at(since).t;
}

std::size_t ImuBuffer::first_after(Time t) const {
  std::size_t low = 0;
  std::size_t high = count_;
  while (low < high) {
    const std::size_t middle = (low + high) / 2;
    if (at(middle).t <= t) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  return low;
}

InertialRates ImuBuffer::rates_at(Time t, std::size_t next) const {
  if (next == 0) return rates(at(0));
  if (next >= count_) return rates(at(count_ - 1));
  const ImuSample& a = at(next - 1);
  const ImuSample& b = at(next);
  const double s = (t - a.t).seconds() / (b.t - a.t).seconds();
  const InertialRates ra = rates(a);
  const InertialRates rb = rates(b);
  return {ra.gyro_rad_s + s * (rb.gyro_rad_s - ra.gyro_rad_s), ra.accel_m_s2 + s * (rb.accel_m_s2 - ra.accel_m_s2)};
}

void ImuBuffer::add_to(Hash64& hash, Time until) const {
  for (std::size_t i = 0; i < count_ && at(i).t <= until; ++i) {
    hash.add(static_cast<std::uint64_t>(at(i).t.ns()));
    hash.add(at(i).gyro_rad_s.data(), at(i).gyro_rad_s.size());
    hash.add(at(i).accel_m_s2.data(), at(i).accel_m_s2.size());
  }
}

ImuStatistics ImuBuffer::statistics(Time from, Time to) const {
  ImuStatistics out;
  Vec3 gyro2 = Vec3::Zero();
  Vec3 accel2 = Vec3::Zero();
  Vec3 gyro = Vec3::Zero();
  Vec3 accel = Vec3::Zero();
  const InertialRates reference = empty() ? InertialRates{} : rates(at(0));  // keeps the sums of squares small
  for (std::size_t i = 0; i < count_; ++i) {
    if (at(i).t < from || at(i).t > to) continue;
    const InertialRates r = rates(at(i));
    const Vec3 w = r.gyro_rad_s - reference.gyro_rad_s;
    const Vec3 a = r.accel_m_s2 - reference.accel_m_s2;
    gyro += w;
    accel += a;
    gyro2 += w.cwiseAbs2();
    accel2 += a.cwiseAbs2();
    ++out.count;
  }
  if (out.count == 0) return out;
  const double n = static_cast<double>(out.count);
  out.mean_gyro_rad_s = reference.gyro_rad_s + gyro / n;
  out.mean_accel_m_s2 = reference.accel_m_s2 + accel / n;
  out.gyro_deviation_rad_s = std::sqrt((gyro2 / n - (gyro / n).cwiseAbs2()).cwiseMax(0.0).sum());
  out.accel_deviation_m_s2 = std::sqrt((accel2 / n - (accel / n).cwiseAbs2()).cwiseMax(0.0).sum());
  return out;
}

}  // namespace plumb
