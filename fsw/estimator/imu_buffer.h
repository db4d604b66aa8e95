#pragma once
// The inertial samples from the fusion horizon to now, and exact integration between any two times they span.

#include <algorithm>
#include <array>

#include "fsw/base/hash.h"
#include "fsw/base/status.h"
#include "fsw/base/time.h"
#include "fsw/math/strapdown.h"
#include "fsw/measurement/samples.h"

namespace plumb {

struct ImuStatistics {
  std::size_t count = 0;
  Vec3 mean_gyro_rad_s = Vec3::Zero();
  Vec3 mean_accel_m_s2 = Vec3::Zero();
  double gyro_deviation_rad_s = 0.0;  ///< root of the summed variances of the three axes
  double accel_deviation_m_s2 = 0.0;
};

/// What the IMU said between two instants no sample lies between: rates as read, linear from start to end.
struct ImuInterval {
  InertialRates start;
  InertialRates end;
  double dt_s = 0.0;
  double period_s = 0.0;  ///< from sample to sample; longer than dt_s where the interval is a part of that
  double hole_s = 0.0;    ///< what the period is longer than it may be without a sample missing
};

class ImuBuffer {
 public:
  static constexpr std::size_t kCapacity = 5120;  ///< 2.5 s at 2 kHz, 20 s at 250 Hz

  void clear() { count_ = 0; }
  bool empty() const { return count_ == 0; }
  std::size_t size() const { return count_; }
  Time oldest() const { return empty() ? Time::never() : at(0).t; }
  Time newest() const { return empty() ? Time::never() : at(count_ - 1).t; }

  /// kOutOfOrder: not after the newest. When full the oldest sample makes room.
  Status push(const ImuSample& sample);
  /// Forgets samples not needed to integrate from t on: all but the last one at or before t.
  void drop_before(Time t);
  /// Whether the next sample would take the place of one that integration from t on needs.
  bool is_exhausted(Time t) const { return count_ == kCapacity && at(1).t > t; }
  /// True when samples bracket both ends.
  bool spans(Time from, Time to) const { return !empty() && oldest() <= from && to <= newest(); }

  /// The sample from which on none was missing for longer than `gap`, up to the first one at or after `to`. Later than
  /// `to` when that lies in such a hole. Precondition: not empty.
  Time unbroken_since(Time to, Duration gap) const;

  /// Calls step(ImuInterval) for each interval between samples from `from` to `to`, the first and the last cut to fit
  /// by linear interpolation, a hole in equal parts: in one, noise in the rates would be the same all along it.
  /// Precondition: spans(from, to).
  template <typename Step>
  void for_each_interval(Time from, Time to, Step step) const {
    if (!(from < to)) return;
    std::size_t i = first_after(from);
    Time t = from;
    InertialRates start = rates_at(from, i);
    for (; i < count_ && t < to; ++i) {
      const Duration period = at(i).t - at(i == 0 ? 0 : i - 1).t;
      const Duration hole = hole_before(i);
      const Time stop = std::min(at(i).t, to);
      const Duration length = stop - t;
      const int parts = hole > Duration::from_ns(0) ? kHoleParts : 1;
      for (int part = 1; part <= parts; ++part) {
        const Time t_end = part == parts ? stop : t + length / parts;
        const InertialRates end = t_end == at(i).t ? rates(at(i)) : rates_at(t_end, i);
        step(ImuInterval{start, end, (t_end - t).seconds(), period.seconds(), hole.seconds()});
        start = end;
        t = t_end;
      }
    }
  }

  /// The rates at t, interpolated. Precondition: spans(t, t).
  InertialRates rates_at(Time t) const { return rates_at(t, first_after(t)); }

  /// Adds the samples at or before `until` to a hash.
  void add_to(Hash64& hash, Time until) const;
  /// Over the samples in [from, to].
  ImuStatistics statistics(Time from, Time to) const;

 private:
  static constexpr int kHoleParts = 8;

  static InertialRates rates(const ImuSample& s) { return {Vec3(s.gyro_rad_s.data()), Vec3(s.accel_m_s2.data())}; }
  const ImuSample& at(std::size_t i) const { return samples_[(first_ + i) % kCapacity]; }
  /// How much longer it took from the sample before to this one than twice the usual, and than 10 ms.
  Duration hole_before(std::size_t sample) const;
  /// Index of the first sample after t.
  std::size_t first_after(Time t) const;
  /// Rates at t, between samples `next` - 1 and `next`.
  InertialRates rates_at(Time t, std::size_t next) const;

  std::array<ImuSample, kCapacity> samples_{};
  std::size_t first_ = 0;
  std::size_t count_ = 0;
};

}  // namespace plumb
