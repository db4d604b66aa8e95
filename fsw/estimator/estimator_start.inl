#pragma once
// Implementation of estimator.h, the part that starts the filter: standing, in motion, or from a given state.

#include "fsw/estimator/estimator.h"
#include "fsw/math/exact.h"

namespace plumb {

// "Zero" uncertainty of what defines the world frame: small against every sensor, large against rounding.
inline constexpr double kPinnedSigma = 1e-6;    // rad, m
inline constexpr double kGivenAttitude = 0.01;  // rad, 1 sigma, start from truth
inline constexpr double kGivenVelocity = 0.05;  // m/s
inline constexpr double kRestTilt = 0.1;        // rad

template <class Config>
Status Estimator<Config>::start(const Frame& frame) {
  StageScope scope(start_given_ ? nullptr : observer_, Stage::kInitialisation);
  StageObserver* const observer = observer_;
  observer_ = nullptr;  // stages do not nest: the first image counts as initialisation
  Status status = Status::kNotReady;
  if (start_given_) {
    start_from_given(frame);
    status = fuse_image(frame);
  } else if (standing_) {
    status = start_standing(frame);
  } else if (options_.start.in_motion) {
    status = start_in_motion(frame);
  }
  observer_ = observer;
  return status;
}

template <class Config>
void Estimator<Config>::begin_filter(Time t, const CoreState& core, const Mat15& covariance) {
  state_.clear();
  tracks_.clear();
  state_.t = t;
  state_.core = core;
  started_t_ = t;
  state_.set_calibration(calibration_, options_.calibration);
  state_.covariance().template fixed<15, 15>(0, 0) = covariance;
  drop_ranges_before(t, RangeOutcome::kStale);
  initialised_ = true;
}

template <class Config>
Mat15 Estimator<Config>::start_covariance(double tilt_rad, double velocity_m_s) const {
  Mat15 p = Mat15::Zero();
  const auto set = [&p](std::size_t at, double sigma) {
    p(static_cast<Eigen::Index>(at), static_cast<Eigen::Index>(at)) = sigma * sigma;
  };
  for (std::size_t k = 0; k < 3; ++k) {
    set(kTheta + k, k < 2 ? tilt_rad : kPinnedSigma);
    set(kXiP + k, kPinnedSigma);
    set(kXiV + k, velocity_m_s);
    set(kGyroBias + k, options_.start.gyro_bias_sigma_rad_s);
    set(kAccelBias + k, options_.start.accel_bias_sigma_m_s2);
  }
  return p;
}

template <class Config>
Status Estimator<Config>::start_standing(const Frame& frame) {
  const double span_s = options_.start.still_window_s;
  const ImuStatistics rest = imu_.statistics(frame.t - Duration::from_seconds(span_s), frame.t);
  CoreState core;
  core.motion.q_WI = level_attitude(rest.mean_accel_m_s2);
  clear_state();
  state_.t = frame.t;                                 // what is recent is judged by it
  drop_ranges_before(frame.t, RangeOutcome::kStale);  // they tell the depth to standing_noise()
  const StandingNoise noise = standing_noise();
  begin_filter(frame.t, core, start_covariance(kRestTilt, noise.velocity_m_s));
  stack_.begin(state_);
  add_zero_rate(state_, stack_, rest.mean_gyro_rad_s,
                exact::hypot(options_.imu.gyro_noise_density / std::sqrt(span_s), noise.rate_rad_s));
  add_gravity(state_, stack_, rest.mean_accel_m_s2, options_.imu.gravity_m_s2,
              options_.imu.accel_noise_density / std::sqrt(span_s));
  const Status status = stack_.apply(state_);
  start_window_.clear();
  return ok(status) ? fuse_image(frame) : status;
}

template <class Config>
void Estimator<Config>::start_from_given(const Frame& frame) {
  CoreState core;
  core.motion.q_WI = Quat(given_.q_WI[0], given_.q_WI[1], given_.q_WI[2], given_.q_WI[3]).normalized();
  core.motion.p_WI_m = Vec3(given_.p_WI_m.data());
  core.motion.v_WI_m_s = Vec3(given_.v_WI_m_s.data());
  core.b_gyro_rad_s = Vec3(given_.b_gyro_rad_s.data());
  core.b_accel_m_s2 = Vec3(given_.b_accel_m_s2.data());
  begin_filter(frame.t, core, start_covariance(kGivenAttitude, kGivenVelocity));
  start_given_ = false;
  start_window_.clear();
}

template <class Config>
Status Estimator<Config>::start_in_motion(const Frame& frame) {
  const Result<StartSolution> solution = start_window_.try_start(frame, imu_, ranges_);
  if (!solution) return Status::kNotReady;
  begin_filter(start_window_.frames().front().t, solution->core, solution->covariance);
  started_t_ = frame.t;  // not when the window began: only from here on can tracks take ranges
  started_excited_ = start_window_.excited();
  propagate_to(frame.t);
  state_.begin_world_here(kPinnedSigma);  // not where the window began: how far that is, is hardly known
  for (const RangeOutcome outcome : solution->ranges) drop_oldest_range(outcome);  // the oldest left are the problem's
  drop_ranges_before(frame.t, RangeOutcome::kSpare);
  start_window_.clear();
  return fuse_image(frame);
}

template <class Config>
void Estimator<Config>::start_from(const NavState& truth) {
  given_ = truth;
  start_given_ = true;
}

}  // namespace plumb
