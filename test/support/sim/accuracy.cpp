#include "test/support/sim/accuracy.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "test/support/sim/direction_model.h"

namespace plumb::sim {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kDegrees = 180.0 / std::numbers::pi;
constexpr double kSettle_s = 1.0;  // before this the position covariance is still singular

// A flight has diverged when its error passes both bounds: a fifth of the distance, and 3 m for those that fly nowhere.
constexpr double kDivergedShare = 0.2;
constexpr double kDivergedFloor_m = 3.0;

using Covariance = Eigen::Map<const Eigen::Matrix<double, kNavErrorSize, kNavErrorSize, Eigen::RowMajor>>;

Vec3 vec3(const std::array<double, 3>& a) { return {a[0], a[1], a[2]}; }
Quat attitude(const NavState& state) { return {state.q_WI[0], state.q_WI[1], state.q_WI[2], state.q_WI[3]}; }

/// Takes the truth into the estimate's world.
struct Alignment {
  Quat turn = Quat::Identity();
  Vec3 shift_m = Vec3::Zero();
};

/// The turn is the twist about the vertical of the whole attitude difference, so that what remains has no vertical
/// component: that is the error whose variance is zero at the start.
Alignment align_at(const FlightPoint& point) {
  const Quat difference = attitude(point.estimate) * point.truth.q_WI.conjugate();
  Alignment alignment;
  alignment.turn = Quat(difference.w(), 0.0, 0.0, difference.z()).normalized();
  alignment.shift_m = vec3(point.estimate.p_WI_m) - alignment.turn * point.truth.p_WI_m;
  return alignment;
}

/// A filter that learns the heading turns its world about its origin, which stays the place that it was.
Alignment turned_east(const Alignment& before) {
  return {east_of_world(), east_of_world() * (before.turn.conjugate() * before.shift_m)};
}

NavError error_of(const FlightPoint& point, const Alignment& alignment) {
  NavError error;
  error.position_m = alignment.turn * point.truth.p_WI_m + alignment.shift_m - vec3(point.estimate.p_WI_m);
  error.velocity_m_s = alignment.turn * point.truth.v_WI_m_s - vec3(point.estimate.v_WI_m_s);
  error.attitude_rad = so3_log(attitude(point.estimate).conjugate() * (alignment.turn * point.truth.q_WI));
  return error;
}

template <int Size>
double normalised_square(const Eigen::Matrix<double, Size, 1>& error, const Covariance& covariance,
                         std::size_t offset) {
  const Eigen::Matrix<double, Size, Size> p = covariance.block<Size, Size>(offset, offset);
  const Eigen::LLT<Eigen::Matrix<double, Size, Size>> factor(p);
  if (factor.info() != Eigen::Success) return kNaN;
  return error.dot(factor.solve(error));
}

Nees nees_of(const NavError& error, const NavState& estimate) {
  const Covariance covariance(estimate.covariance.data());
  Eigen::Matrix<double, 9, 1> joint;
  joint << error.position_m, error.velocity_m_s, error.attitude_rad;
  return {normalised_square<3>(error.position_m, covariance, kNavPosition),
          normalised_square<3>(error.velocity_m_s, covariance, kNavVelocity),
          normalised_square<3>(error.attitude_rad, covariance, kNavAttitude),
          normalised_square<9>(joint, covariance, kNavPosition)};
}

const FlightPoint* nearest_valid(const FlightLog& log, double t_s) {
  const FlightPoint* best = nullptr;
  for (const FlightPoint& point : log.points) {
    if (!point.estimate.valid) continue;
    if (best == nullptr || std::abs(point.t_s - t_s) < std::abs(best->t_s - t_s)) best = &point;
  }
  return best;
}

double cruise_scale_percent(const FlightLog& log) {
  if (log.cruise_end_s <= log.cruise_start_s) return kNaN;
  const FlightPoint* first = nearest_valid(log, log.cruise_start_s);
  const FlightPoint* last = nearest_valid(log, log.cruise_end_s);
  if (first == nullptr || first == last) return kNaN;
  const double estimated_m = (vec3(last->estimate.p_WI_m) - vec3(first->estimate.p_WI_m)).norm();
  const double true_m = (last->truth.p_WI_m - first->truth.p_WI_m).norm();
  return 100.0 * (estimated_m / true_m - 1.0);
}

double sim3_scale_percent(const FlightLog& log) {
  std::vector<const FlightPoint*> valid;
  for (const FlightPoint& point : log.points) {
    if (point.estimate.valid) valid.push_back(&point);
  }
  if (valid.size() < 3) return kNaN;
  Eigen::Matrix3Xd truth(3, valid.size());
  Eigen::Matrix3Xd estimate(3, valid.size());
  for (std::size_t i = 0; i < valid.size(); ++i) {
    truth.col(i) = valid[i]->truth.p_WI_m;
    estimate.col(i) = vec3(valid[i]->estimate.p_WI_m);
  }
  // With c R the best similarity from truth to estimate, det(c R) = c^3.
  const Eigen::Matrix4d similarity = Eigen::umeyama(truth, estimate, true);
  return 100.0 * (std::cbrt(similarity.topLeftCorner<3, 3>().determinant()) - 1.0);
}

/// Adds a value to a mean unless it is not a number.
struct Mean {
  double sum = 0.0;
  int count = 0;
  void add(double x) {
    if (std::isnan(x)) return;
    sum += x;
    ++count;
  }
  double value() const { return count > 0 ? sum / count : kNaN; }
};

Nees mean_nees(const std::vector<ErrorPoint>& errors) {
  Mean position;
  Mean velocity;
  Mean attitude_mean;
  Mean joint;
  for (const ErrorPoint& point : errors) {
    if (point.t_s < errors.front().t_s + kSettle_s) continue;
    position.add(point.nees.position);
    velocity.add(point.nees.velocity);
    attitude_mean.add(point.nees.attitude);
    joint.add(point.nees.joint);
  }
  return {position.value(), velocity.value(), attitude_mean.value(), joint.value()};
}

const ErrorPoint& nearest(const std::vector<ErrorPoint>& errors, double t_s) {
  return *std::min_element(errors.begin(), errors.end(), [t_s](const ErrorPoint& a, const ErrorPoint& b) {
    return std::abs(a.t_s - t_s) < std::abs(b.t_s - t_s);
  });
}

double distance_after(const FlightLog& log, double t_s) {
  double distance_m = 0.0;
  for (std::size_t i = 1; i < log.points.size(); ++i) {
    if (log.points[i - 1].t_s < t_s) continue;
    distance_m += (log.points[i].truth.p_WI_m - log.points[i - 1].truth.p_WI_m).norm();
  }
  return distance_m;
}

void sum_errors(const std::vector<ErrorPoint>& errors, Accuracy& out) {
  Mean position;
  Mean velocity;
  Mean attitude_mean;
  double worst_axis_m = 0.0;
  bool finite = true;
  for (const ErrorPoint& point : errors) {
    finite = finite && point.error.position_m.allFinite() && point.error.velocity_m_s.allFinite() &&
             point.error.attitude_rad.allFinite();
    position.add(point.error.position_m.squaredNorm());
    velocity.add(point.error.velocity_m_s.squaredNorm());
    attitude_mean.add(point.error.attitude_rad.squaredNorm());
    worst_axis_m = std::max(worst_axis_m, point.error.position_m.cwiseAbs().maxCoeff());
  }
  out.position_rmse_m = std::sqrt(position.value());
  out.velocity_rmse_m_s = std::sqrt(velocity.value());
  out.attitude_rmse_deg = kDegrees * std::sqrt(attitude_mean.value());
  out.worst_axis_percent = 100.0 * worst_axis_m / out.distance_m;
  out.diverged = !finite || worst_axis_m > std::max(kDivergedFloor_m, kDivergedShare * out.distance_m);
}

/// Those that were refused count like those that were used.
void sum_innovations(const FlightLog& log, Accuracy& out) {
  double feature_sum = 0.0;
  double track_sum = 0.0;
  double ranged_sum = 0.0;
  double features = 0.0;
  double rows = 0.0;
  double ranged = 0.0;
  Mean range;
  for (const FlightPoint& point : log.points) {
    const FrameReport& report = point.report;
    feature_sum += report.slam_nis;
    features += report.slam_used + report.slam_rejected;
    track_sum += report.track_nis;
    rows += report.track_rows;
    ranged_sum += report.ranged_nis;
    ranged += report.ranged_judged;
    if (report.range_outcome != RangeOutcome::kUsed && report.range_outcome != RangeOutcome::kGated) continue;
    const double innovation = (report.range_measured_m - report.range_predicted_m) / report.range_sigma_m;
    range.add(innovation * innovation);
  }
  out.feature_nis = feature_sum / features;
  out.track_nis = track_sum / rows;
  out.ranged_nis = ranged_sum / ranged;
  out.range_nis = range.value();
}

}  // namespace

std::vector<ErrorPoint> errors_of(const FlightLog& log) {
  std::vector<ErrorPoint> errors;
  Alignment alignment;
  bool heading_known = false;
  for (const FlightPoint& point : log.points) {
    if (!point.estimate.valid) continue;
    if (errors.empty()) alignment = align_at(point);
    if (point.estimate.heading_known && !heading_known) alignment = turned_east(alignment);
    heading_known = point.estimate.heading_known;
    const NavError error = error_of(point, alignment);
    errors.push_back({point.t_s, error, nees_of(error, point.estimate)});
  }
  return errors;
}

Accuracy evaluate(const FlightLog& log) {
  Accuracy out;
  const std::vector<ErrorPoint> errors = errors_of(log);
  out.diverged = true;
  if (errors.empty()) return out;
  out.started = true;
  out.first_output_s = errors.front().t_s;
  out.distance_m = distance_after(log, out.first_output_s);
  sum_errors(errors, out);
  if (log.counters.resets > 0 || !log.points.back().estimate.valid) out.diverged = true;
  const auto due = std::count_if(log.points.begin(), log.points.end(),
                                 [&](const FlightPoint& point) { return point.t_s >= out.first_output_s; });
  out.coverage_percent = 100.0 * static_cast<double>(errors.size()) / static_cast<double>(due);
  out.position_final_m = errors.back().error.position_m.norm();
  // Local attitude errors of a level body: the z component is the heading.
  out.yaw_final_deg = kDegrees * errors.back().error.attitude_rad.z();
  out.cruise_scale_percent = cruise_scale_percent(log);
  out.sim3_scale_percent = sim3_scale_percent(log);
  for (std::size_t i = 0; i < kCheckpoints.size(); ++i)
    out.nees[i] = nearest(errors, kCheckpoints[i] * log.length_s).nees;
  out.mean_nees = mean_nees(errors);
  const double ranges = static_cast<double>(log.counters.ranges);
  out.range_used_percent =
      ranges > 0.0 ? 100.0 * static_cast<double>(log.counters.ranges_used + log.counters.ranges_feature) / ranges : 0.0;
  sum_innovations(log, out);
  return out;
}

double chi_square_quantile(double probability, double dof) {
  // Normal quantile by bisection of the error function, then the cube-root transformation.
  double low = -8.0;
  double high = 8.0;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (0.5 * std::erfc(-middle / std::numbers::sqrt2) < probability ? low : high) = middle;
  }
  const double spread = 2.0 / (9.0 * dof);
  const double root = 1.0 - spread + low * std::sqrt(spread);
  return dof * root * root * root;
}

Interval nees_bounds(double probability, int dof, int runs) {
  const double total = static_cast<double>(dof) * runs;
  const double tail = 0.5 * (1.0 - probability);
  return {chi_square_quantile(tail, total) / runs, chi_square_quantile(1.0 - tail, total) / runs};
}

}  // namespace plumb::sim
