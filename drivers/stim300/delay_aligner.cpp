#include "drivers/stim300/delay_aligner.h"

#include <algorithm>

namespace plumb::stim300 {

DelayAligner::DelayAligner(Duration gyro_delay, Duration accel_delay)
    : gyro_is_faster_(gyro_delay < accel_delay),
      delay_(std::max(gyro_delay, accel_delay)),
      difference_(delay_ - std::min(gyro_delay, accel_delay)) {
  PLUMB_ASSERT(delay_ - difference_ >= Duration());
  PLUMB_ASSERT(difference_ < kMaxDifference);
}

Result<ImuSample> DelayAligner::push(const ImuSample& reading, Time t_unit) {
  if (count_ > 0) {
    PLUMB_ASSERT(t_unit > back(0).t);
    if (t_unit - back(0).t > kMaxGap) count_ = 0;
  }
  readings_[next_] = {.t = t_unit, .value = gyro_is_faster_ ? reading.gyro_rad_s : reading.accel_m_s2};
  next_ = (next_ + 1) % kCapacity;
  count_ = std::min(count_ + 1, kCapacity);

  const Result<Vector> faster = at(t_unit - difference_);
  if (!faster) return faster.status();
  ImuSample sample = reading;
  sample.t = reading.t - delay_;
  (gyro_is_faster_ ? sample.gyro_rad_s : sample.accel_m_s2) = *faster;
  return sample;
}

Result<DelayAligner::Vector> DelayAligner::at(Time t) const {
  for (std::size_t i = 0; i < count_; ++i) {  // from the newest back
    const Reading& before = back(i);
    if (before.t > t) continue;
    if (i == 0) return before.value;  // no difference at all
    const Reading& after = back(i - 1);
    const double weight = (t - before.t).seconds() / (after.t - before.t).seconds();
    Vector value{};
    for (std::size_t axis = 0; axis < value.size(); ++axis) {
      value[axis] = before.value[axis] + weight * (after.value[axis] - before.value[axis]);
    }
    return value;
  }
  return Status::kNotReady;
}

}  // namespace plumb::stim300
