#include "fsw/predictor/output_predictor.h"

#include <cmath>

namespace plumb {
namespace {

Vec3 to_vec3(const std::array<double, 3>& a) { return {a[0], a[1], a[2]}; }

template <std::size_t N>
bool all_finite(const std::array<double, N>& values) {
  for (const double value : values) {
    if (!std::isfinite(value)) return false;
  }
  return true;
}

InertialRates interpolate(const InertialRates& a, const InertialRates& b, double fraction) {
  return {.gyro_rad_s = a.gyro_rad_s + fraction * (b.gyro_rad_s - a.gyro_rad_s),
          .accel_m_s2 = a.accel_m_s2 + fraction * (b.accel_m_s2 - a.accel_m_s2)};
}

}  // namespace

Status OutputPredictor::add_imu(const ImuSample& newest) {
  if (!all_finite(newest.gyro_rad_s) || !all_finite(newest.accel_m_s2)) {
    ++counters_.refused_samples;
    return Status::kInvalidValue;
  }
  if (count_ > 0) {
    const ImuSample& previous = sample(count_ - 1);
    if (newest.t <= previous.t) {
      ++counters_.refused_samples;
      return Status::kOutOfOrder;
    }
    if ((newest.t - previous.t).seconds() > options_.max_gap_s) {
      ++counters_.gaps;
      state_.valid = false;
      count_ = 0;  // nothing may be integrated across the hole, so nothing before it is of use
    } else if (state_.valid) {
      advance(previous, newest);
      write_state();
    }
  }
  push(newest);
  return Status::kOk;
}

Status OutputPredictor::correct(const NavState& corrected) {
  if (!corrected.valid) {
    state_ = corrected;
    return Status::kOk;
  }
  const bool same_run = state_.valid && corrected.reset_count == state_.reset_count;
  if (same_run && corrected.t < t_corrected_) {
    ++counters_.stale_corrections;
    return Status::kOutOfOrder;
  }
  if (count_ == 0 || corrected.t < sample(0).t) {
    ++counters_.stale_corrections;
    return Status::kStale;
  }
  if (!all_finite(corrected.p_WI_m) || !all_finite(corrected.v_WI_m_s) || !all_finite(corrected.q_WI) ||
      !all_finite(corrected.b_gyro_rad_s) || !all_finite(corrected.b_accel_m_s2) || !all_finite(corrected.gyro_scale) ||
      !all_finite(corrected.accel_scale)) {
    state_.valid = false;
    return Status::kNumericalFault;
  }
  const KinematicState before = kinematic_;
  const Time t_before = t_kinematic_;
  ++counters_.corrections;
  t_corrected_ = corrected.t;
  t_kinematic_ = corrected.t;
  const std::array<double, 4>& q = corrected.q_WI;
  kinematic_ = {.q_WI = Quat(q[0], q[1], q[2], q[3]),
                .p_WI_m = to_vec3(corrected.p_WI_m),
                .v_WI_m_s = to_vec3(corrected.v_WI_m_s)};
  b_gyro_rad_s_ = to_vec3(corrected.b_gyro_rad_s);
  b_accel_m_s2_ = to_vec3(corrected.b_accel_m_s2);
  gyro_scale_ = to_vec3(corrected.gyro_scale);
  accel_scale_ = to_vec3(corrected.accel_scale);
  drop_before(corrected.t);
  for (std::size_t i = 1; i < count_; ++i) advance(sample(i - 1), sample(i));
  record_jump(before, same_run && t_before == t_kinematic_);
  state_ = corrected;
  write_state();
  return Status::kOk;
}

void OutputPredictor::push(const ImuSample& newest) {
  if (count_ == kMaxSamples) {  // the oldest goes; a correction that would need it is then refused as stale
    first_ = (first_ + 1) % kMaxSamples;
    --count_;
  }
  ring_[(first_ + count_) % kMaxSamples] = newest;
  ++count_;
}

// Keeps the last sample at or before t: the interval that holds t starts with it.
void OutputPredictor::drop_before(Time t) {
  while (count_ > 1 && sample(1).t <= t) {
    first_ = (first_ + 1) % kMaxSamples;
    --count_;
  }
}

// Steps from the state's own time, which may lie inside [start, end], to the end of the interval.
void OutputPredictor::advance(const ImuSample& start, const ImuSample& end) {
  if (end.t <= t_kinematic_) return;
  const auto rates = [this](const ImuSample& raw) {
    const InertialRates read{to_vec3(raw.gyro_rad_s), to_vec3(raw.accel_m_s2)};
    return without_bias(with_scale(read, gyro_scale_, accel_scale_), b_gyro_rad_s_, b_accel_m_s2_);
  };
  const InertialRates rates_start = rates(start);
  const InertialRates rates_end = rates(end);
  const double fraction = (t_kinematic_ - start.t).seconds() / (end.t - start.t).seconds();
  strapdown_step(kinematic_, interpolate(rates_start, rates_end, fraction), rates_end, (end.t - t_kinematic_).seconds(),
                 options_.gravity_m_s2);
  t_kinematic_ = end.t;
}

void OutputPredictor::write_state() {
  state_.t = t_kinematic_;
  for (std::size_t i = 0; i < 3; ++i) {
    state_.p_WI_m[i] = kinematic_.p_WI_m[static_cast<Eigen::Index>(i)];
    state_.v_WI_m_s[i] = kinematic_.v_WI_m_s[static_cast<Eigen::Index>(i)];
  }
  state_.q_WI = {kinematic_.q_WI.w(), kinematic_.q_WI.x(), kinematic_.q_WI.y(), kinematic_.q_WI.z()};
}

void OutputPredictor::record_jump(const KinematicState& before, bool comparable) {
  tracking_ = {};
  if (!comparable) return;
  tracking_.position_m = (kinematic_.p_WI_m - before.p_WI_m).norm();
  tracking_.velocity_m_s = (kinematic_.v_WI_m_s - before.v_WI_m_s).norm();
  tracking_.attitude_rad = so3_log(before.q_WI.conjugate() * kinematic_.q_WI).norm();
}

}  // namespace plumb
