#pragma once
// Joins gyro and accelerometer readings of one datagram that tell of different instants: the filters of the two delay
// by different times, 4.1 ms apart at equal settings. The faster of the two is remembered and interpolated at the
// instant that the slower one tells of.

#include <array>
#include <cstddef>

#include "fsw/base/status.h"
#include "fsw/base/time.h"
#include "fsw/measurement/samples.h"

namespace plumb::stim300 {

class DelayAligner {
 public:
  /// From the motion to the time of the reading. Precondition: not negative, and apart by less than kMaxDifference.
  DelayAligner(Duration gyro_delay, Duration accel_delay);

  static constexpr Duration kMaxDifference = Duration::from_ms(31);  ///< what 64 readings at 2 kHz reach back
  /// Nothing is interpolated over a longer gap between readings.
  static constexpr Duration kMaxGap = Duration::from_ms(20);

  /// Takes the readings of one datagram, `reading.t` being the time of its sample and `t_unit` that by the unit's own
  /// count, from any zero: readings are joined by the latter, because stamps move with what the host learns of its
  /// delays. Returns them for one instant, with the delay taken off its stamp; kNotReady while the faster sensor is not
  /// remembered far enough back. Precondition: `t_unit` after that of the reading before.
  Result<ImuSample> push(const ImuSample& reading, Time t_unit);

 private:
  using Vector = std::array<double, 3>;
  struct Reading {
    Time t;  ///< the unit's
    Vector value{};
  };
  static constexpr std::size_t kCapacity = 64;

  const Reading& back(std::size_t i) const { return readings_[(next_ + kCapacity - 1 - i) % kCapacity]; }
  Result<Vector> at(Time t) const;

  bool gyro_is_faster_;
  Duration delay_;                             ///< of the slower sensor
  Duration difference_;                        ///< of the faster one to it
  std::array<Reading, kCapacity> readings_{};  ///< of the faster sensor
  std::size_t next_ = 0;
  std::size_t count_ = 0;
};

}  // namespace plumb::stim300
