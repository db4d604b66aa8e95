#pragma once
// Directions known in the world (sun, magnetic field), which hold the heading that camera, IMU and range leave free.
//
// With the true attitude R = Exp(theta) R_hat, a direction d of W is seen as m = R^T d, so that
//
//     R_hat m = Exp(-theta) d = d + [d]x theta
//
// to first order, whatever the state: the rows depend on the known direction alone. Of the sun both components across d
// count; of the magnetic field its azimuth, because iron and currents bend the inclination.
//
// The filter starts with an arbitrary heading. The first directions that agree turn the world to it: from then on W has
// x east, y north. The turn comes with a heading uncertainty that covers everything, common to all poses, which is what
// "unknown" means; the direction is then used like any other, and leaves the heading as sure as it is itself.

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "fsw/estimator/chi_square.h"
#include "fsw/estimator/imu_buffer.h"
#include "fsw/estimator/report.h"
#include "fsw/estimator/update_stack.h"
#include "fsw/math/exact.h"
#include "fsw/measurement/samples.h"

namespace plumb {

/// An angle brought to (-pi, pi].
inline double wrap_angle(double rad) {
  const double turns = std::round(rad / (2.0 * std::numbers::pi));
  return rad - 2.0 * std::numbers::pi * turns;
}

template <class Config>
class DirectionUpdate {
 public:
  explicit DirectionUpdate(const DirectionOptions& options)
      : noise_rad_{options.sun_noise_rad, options.magnetometer_noise_rad}, gate_(options.gate_probability) {}
  /// Other options from here on. What waits of a source that is switched off is dropped.
  void use(const DirectionOptions& options) {
    noise_rad_ = {options.sun_noise_rad, options.magnetometer_noise_rad};
    if (options.gate_probability != gate_.probability()) gate_ = ChiSquareTable(options.gate_probability);
    for (std::size_t i = pending_.size(); i > 0; --i) {
      if (sigma_rad(pending_[i - 1]) == 0.0) pending_.erase(i - 1);
    }
  }

  /// Forgets everything: the world's heading is arbitrary again.
  void clear() {
    pending_.clear();
    offsets_rad_.clear();
    heading_known_ = false;
  }
  /// Whether W's x axis points east.
  bool heading_known() const { return heading_known_; }
  void add_to(Hash64& hash) const {
    hash.add(std::uint64_t{heading_known_ ? 1U : 0U});
    hash.add(offsets_rad_.data(), offsets_rad_.size());
  }

  /// Keeps one sample until the image that it belongs to. kInvalidValue, kOutOfOrder (not after the last one of its
  /// source): dropped. One of a source that is switched off is ignored.
  Status add(const DirectionSample& sample, EstimatorCounters& counters);

  /// Uses the newest direction of each source up to t, carried to t by the gyro; those before it are spare: what is
  /// wrong with a direction lasts far longer than an image. Precondition: the state stands at t. Returns whether the
  /// world has been turned. kNumericalFault only when the covariance is unsound.
  Result<bool> fuse(FilterState<Config>& state, UpdateStack<Config>& stack, const ImuBuffer& imu, Time t,
                    FrameReport& report, EstimatorCounters& counters);

 private:
  static constexpr std::size_t kMaxPending = 32;
  static constexpr std::size_t kAgreeing = 3;         ///< directions that must agree before the world is turned
  static constexpr double kAgreement = 5.0;           ///< sigmas between them
  static constexpr double kUnknownHeading_rad = 1.0;  ///< 1 sigma; the correction is nil, so it need not be small
  static constexpr double kMinHorizontal = 0.1;       ///< share of a direction that must be horizontal for an azimuth
  static constexpr double kMaxAge_s = 0.1;
  using Rows = Eigen::Matrix<double, 2, 3, Eigen::RowMajor>;

  static Vec3 unit(const std::array<double, 3>& v) { return Vec3(v.data()).normalized(); }
  static double azimuth(const Vec3& v) { return exact::atan2(v.y(), v.x()); }
  double sigma_rad(const DirectionSample& sample) const { return noise_rad_[static_cast<std::size_t>(sample.source)]; }

  bool take_newest(DirectionSource source, Time t, DirectionSample& out, EstimatorCounters& counters);
  Status use(FilterState<Config>& state, UpdateStack<Config>& stack, const DirectionSample& sample, const Vec3& seen_I,
             FrameReport& report, EstimatorCounters& counters);
  bool turn_to(FilterState<Config>& state, const Vec3& known, const Vec3& seen_W, double sigma_rad);

  std::array<double, kDirectionSources> noise_rad_;
  ChiSquareTable gate_;
  FixedVector<DirectionSample, kMaxPending> pending_;  ///< in order of arrival
  std::array<Time, kDirectionSources> newest_{Time::never(), Time::never()};
  FixedVector<double, kAgreeing> offsets_rad_;  ///< of the world's heading, as the last directions have it
  bool heading_known_ = false;
};

template <class Config>
Status DirectionUpdate<Config>::add(const DirectionSample& sample, EstimatorCounters& counters) {
  ++counters.directions;
  const Vec3 seen(sample.seen_I.data());
  const Vec3 known(sample.known_W.data());
  const bool sane = static_cast<std::size_t>(sample.source) < kDirectionSources && seen.allFinite() &&
                    known.allFinite() && seen.norm() > 0.0 && known.norm() > 0.0;
  if (!sane) {
    ++counters.directions_invalid;
    return Status::kInvalidValue;
  }
  if (sigma_rad(sample) == 0.0) return Status::kOk;
  Time& newest = newest_[static_cast<std::size_t>(sample.source)];
  if (sample.t <= newest) {
    ++counters.directions_invalid;
    return Status::kOutOfOrder;
  }
  newest = sample.t;
  if (pending_.full()) {
    pending_.erase(0);
    ++counters.directions_spare;
  }
  return pending_.push_back(sample);
}

template <class Config>
bool DirectionUpdate<Config>::take_newest(DirectionSource source, Time t, DirectionSample& out,
                                          EstimatorCounters& counters) {
  bool found = false;
  for (std::size_t i = 0; i < pending_.size();) {
    if (pending_[i].source != source || pending_[i].t > t) {
      ++i;
      continue;
    }
    if (found) ++counters.directions_spare;
    out = pending_[i];
    found = true;
    pending_.erase(i);
  }
  if (found && (t - out.t).seconds() > kMaxAge_s) {
    ++counters.directions_spare;
    return false;
  }
  return found;
}

template <class Config>
Result<bool> DirectionUpdate<Config>::fuse(FilterState<Config>& state, UpdateStack<Config>& stack, const ImuBuffer& imu,
                                           Time t, FrameReport& report, EstimatorCounters& counters) {
  bool turned = false;
  for (const DirectionSource source : {DirectionSource::kSun, DirectionSource::kMagnetometer}) {
    DirectionSample sample;
    if (!take_newest(source, t, sample, counters)) continue;
    if (!imu.spans(sample.t, t)) {
      ++counters.directions_spare;
      continue;
    }
    const Vec3 seen_I = gyro_rotation(imu, state.core, sample.t, t).conjugate() * unit(sample.seen_I);
    if (!heading_known_) {
      if (!turn_to(state, unit(sample.known_W), state.core.motion.q_WI * seen_I, sigma_rad(sample))) {
        ++counters.directions_spare;
        continue;
      }
      heading_known_ = turned = true;
    }
    const Status status = use(state, stack, sample, seen_I, report, counters);
    if (!ok(status)) return status;
  }
  report.heading_known = heading_known_;
  return turned;
}

template <class Config>
bool DirectionUpdate<Config>::turn_to(FilterState<Config>& state, const Vec3& known, const Vec3& seen_W,
                                      double sigma_rad) {
  const double horizontal = std::min(known.template head<2>().norm(), seen_W.template head<2>().norm());
  if (horizontal < kMinHorizontal) return false;
  if (offsets_rad_.full()) offsets_rad_.erase(0);
  const double offset_rad = wrap_angle(azimuth(known) - azimuth(seen_W));
  static_cast<void>(offsets_rad_.push_back(offset_rad));
  const bool agree = std::all_of(offsets_rad_.begin(), offsets_rad_.end(), [&](double other) {
    return std::abs(wrap_angle(other - offset_rad)) <= kAgreement * sigma_rad / horizontal;
  });
  if (!agree || !offsets_rad_.full()) return false;
  state.turn_world(offset_rad, kUnknownHeading_rad);
  return true;
}

template <class Config>
Status DirectionUpdate<Config>::use(FilterState<Config>& state, UpdateStack<Config>& stack,
                                    const DirectionSample& sample, const Vec3& seen_I, FrameReport& report,
                                    EstimatorCounters& counters) {
  const Vec3 known = unit(sample.known_W);
  const Vec3 seen_W = state.core.motion.q_WI * seen_I;
  const double horizontal = known.template head<2>().norm();
  const double sigma = sigma_rad(sample);
  // Across d: to the east of it, level, and upwards.
  const Vec3 east = horizontal > 0.0 ? Vec3(-known.y(), known.x(), 0.0) / horizontal : Vec3(Vec3::UnitX());
  const bool azimuth_only = sample.source == DirectionSource::kMagnetometer;
  if (azimuth_only && std::min(horizontal, seen_W.template head<2>().norm()) < kMinHorizontal) {
    ++counters.directions_spare;
    return Status::kOk;
  }
  Rows across;
  across << east.transpose(), known.cross(east).transpose();
  const std::size_t rows = azimuth_only ? 1 : 2;
  const Rows jacobian = across * skew(known) / sigma;
  Vec2 residual = across * (seen_W - known) / sigma;
  if (azimuth_only) residual.x() = horizontal * wrap_angle(azimuth(seen_W) - azimuth(known)) / sigma;

  stack.begin(state);
  MatrixView h = stack.open(rows);
  for (std::size_t r = 0; r < rows; ++r) {
    h.template fixed<1, 3>(r, kTheta) = jacobian.row(static_cast<Eigen::Index>(r));
    stack.residual(r) = residual(static_cast<Eigen::Index>(r));
  }
  Support support;
  static_cast<void>(support.push_back({kTheta, 3}));
  const double nis = stack.close(state, support);
  if (!std::isfinite(nis)) return Status::kNumericalFault;
  if (nis > gate_.quantile(rows)) {
    ++counters.directions_gated;
    return Status::kOk;
  }
  ++counters.directions_used;
  ++report.directions_used;
  return stack.apply(state);
}

}  // namespace plumb
