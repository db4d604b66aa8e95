#include "fsw/estimator/motion_start.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "fsw/estimator/facet_search.h"
#include "fsw/math/exact.h"
#include "fsw/math/kernels.h"

namespace plumb {
namespace {

constexpr int kMaxIterations = 20;
constexpr std::size_t kMinFeatures = 10;
constexpr double kMinFlowPx = 4.0;  // of the median feature: without flow there is nothing to tell from
constexpr double kHuber = 2.0;      // sigmas
constexpr double kMaxRmsPx = 2.0;
constexpr double kRelativeFacetError = 0.1;    // of the inverse depth: how flat a facet is taken to be,
constexpr double kFacetRelief = 0.5;           // and of what its vertices differ by
constexpr double kDefaultInverseDepth = 0.5;   // 1/m, first guess without a range
constexpr double kVelocityPrior = 20.0;        // m/s
constexpr double kTiltPrior = 0.5;             // rad
constexpr double kDepthPrior = 2.0;            // of the first guess, 1 sigma: keeps an unobserved scale where it is
constexpr double kRelativeNearestError = 0.3;  // the same for the nearest feature, where no facet is hit
constexpr double kPinned = 1e-6;               // yaw and position define the world frame
constexpr double kMaxDamping = 1e8;

/// Huber weight of a residual of whitened length r.
double robust_weight(double r) { return r <= kHuber ? 1.0 : kHuber / r; }
double robust_cost(double r) { return r <= kHuber ? r * r : kHuber * (2.0 * r - kHuber); }

double guessed_inverse_depth(const StartProblem& problem) {
  return problem.ranges.empty() ? kDefaultInverseDepth : 1.0 / problem.ranges.front().range_m;
}

/// What the inverse depth at an image point is made of: the facet around it, or else the nearest feature alone.
struct Surface {
  std::array<std::size_t, 3> features{};
  Vec3 weights = Vec3::UnitX();
  double relative_error = kRelativeNearestError;
};

Surface surface_at(const StartProblem& problem, const Vec2& query) {
  Surface out;
  FixedVector<Vec2, kMaxStartFeatures> points;
  for (const StartFeature& feature : problem.features) static_cast<void>(points.push_back(feature.anchor_z));
  const Result<FacetChoice> facet = find_facet({points.data(), points.size()}, query);
  if (facet) {
    const Vec3 weights = barycentric({points.data(), points.size()}, *facet) * query.homogeneous();
    return {facet->vertices, weights, kRelativeFacetError};
  }
  const auto nearer = [&](const Vec2& a, const Vec2& b) { return (a - query).norm() < (b - query).norm(); };
  const auto nearest =
      static_cast<std::size_t>(std::min_element(points.begin(), points.end(), nearer) - points.begin());
  out.features = {nearest, nearest, nearest};  // weight on the first; the others count nothing
  return out;
}

double median_flow(const StartProblem& problem) {
  FixedVector<double, kMaxStartFeatures> flow;
  for (const StartFeature& f : problem.features)
    static_cast<void>(flow.push_back((f.earlier[0].z - f.anchor_z).norm()));
  std::sort(flow.begin(), flow.end());
  return flow[flow.size() / 2];
}

}  // namespace

Result<StartSolution> MotionStart::solve(const StartProblem& problem, const ImuBuffer& imu) {
  const std::size_t features = problem.features.size();
  if (features < kMinFeatures || problem.images.size() < 3) return Status::kIllConditioned;
  if (median_flow(problem) * calibration_.focal_px < kMinFlowPx) return Status::kIllConditioned;
  const std::size_t unknowns = kCoreSize + features;
  Estimate estimate = first_guess(problem, imu);
  double cost = linearise(problem, imu, estimate);
  double damping = 1e-3;
  double step[kMaxUnknowns];
  for (int i = 0; i < kMaxIterations && damping < kMaxDamping; ++i) {
    if (!solve_step(damping, unknowns, step)) return Status::kNumericalFault;
    Estimate trial = estimate;
    retract_core(trial.core, step);
    for (std::size_t j = 0; j < features; ++j) trial.rho[j] += step[kCoreSize + j];
    const double trial_cost = linearise(problem, imu, trial);
    if (!(trial_cost < cost)) {
      damping *= 8.0;
      linearise(problem, imu, estimate);
      continue;
    }
    const bool converged = cost - trial_cost < 1e-6 * cost;
    estimate = trial;
    cost = trial_cost;
    damping *= 0.2;
    if (converged) break;
  }
  linearise(problem, imu, estimate);
  const std::size_t inside = static_cast<std::size_t>(
      std::count_if(estimate.rho.begin(), estimate.rho.begin() + static_cast<std::ptrdiff_t>(features),
                    [](double rho) { return rho > 0.0; }));
  const double dof = static_cast<double>(std::max<std::size_t>(residuals_, unknowns + 1) - unknowns);
  StartSolution out;
  out.rms_px = std::sqrt(squared_residuals_ / dof) * options_.vision.pixel_noise_px;
  if (!std::isfinite(cost) || 4 * inside < 3 * features || !(out.rms_px < kMaxRmsPx)) return Status::kRejected;
  out.core = estimate.core;
  out.ranges = range_outcomes_;
  if (!core_covariance(unknowns, out.covariance)) return Status::kNumericalFault;
  out.velocity_sigma_m_s = std::sqrt(out.covariance.diagonal().segment<3>(static_cast<Eigen::Index>(kXiV)).sum());
  return out;
}

MotionStart::Estimate MotionStart::first_guess(const StartProblem& problem, const ImuBuffer& imu) const {
  // Specific force averaged over up to a second before the window as well, in the frame of the first image: whatever
  // the vehicle did, its velocity changed by little against a second of gravity.
  const Time first = problem.images.front();
  const Time from = std::max(imu.oldest(), first - Duration::from_ms(1000));
  KinematicState s;
  const auto step = [&s](const ImuInterval& i) { strapdown_step(s, i.start, i.end, i.dt_s, 0.0); };
  imu.for_each_interval(from, first, step);
  const Quat q_first = s.q_WI;
  imu.for_each_interval(first, problem.images.back(), step);
  Estimate out;
  out.core.motion.q_WI = rotation_between(q_first.conjugate() * s.v_WI_m_s, Vec3::UnitZ());
  out.rho.fill(guessed_inverse_depth(problem));
  return out;
}

void MotionStart::integrate(const StartProblem& problem, const ImuBuffer& imu, const CoreState& start) {
  CoreState core = start;
  CoreTransition transition;
  Time t = problem.images.front();
  std::size_t next_range = 0;
  const auto advance = [&](Time to, Station& station) {
    imu.for_each_interval(
        t, to, [&](const ImuInterval& interval) { propagate_step(core, transition, interval, options_.imu); });
    t = std::max(t, to);
    station.camera.R_WC = (core.motion.q_WI * calibration_.q_IC).toRotationMatrix();
    station.camera.p_WC_m = core.motion.p_WI_m + core.motion.q_WI * calibration_.p_IC_m;
    station.by_start = transition.phi.topRows<6>();
  };
  for (std::size_t i = 0; i < problem.images.size(); ++i) {
    for (; next_range < problem.ranges.size() && problem.ranges[next_range].t <= problem.images[i]; ++next_range) {
      advance(problem.ranges[next_range].t, ranges_[next_range]);
    }
    advance(problem.images[i], images_[i]);
  }
}

double MotionStart::linearise(const StartProblem& problem, const ImuBuffer& imu, const Estimate& estimate) {
  const std::size_t unknowns = kCoreSize + problem.features.size();
  integrate(problem, imu, estimate.core);
  MatrixView a = a_.view(unknowns, unknowns);
  for (std::size_t r = 0; r < unknowns; ++r) std::fill_n(a.row(r), unknowns, 0.0);
  std::fill_n(b_, unknowns, 0.0);
  squared_residuals_ = 0.0;
  residuals_ = 0;
  range_outcomes_.clear();
  double cost = add_prior(estimate.core);
  for (std::size_t j = 0; j < problem.features.size(); ++j) cost += add_feature(problem, j, estimate.rho[j]);
  for (std::size_t k = 0; k < problem.ranges.size(); ++k) cost += add_range(problem, k, estimate);
  return cost;
}

double MotionStart::add_prior(const CoreState& core) {
  MatrixView a = a_.view();
  const auto prior = [&](std::size_t at, double sigma, double deviation) {
    a(at, at) += 1.0 / (sigma * sigma);
    b_[at] -= deviation / (sigma * sigma);
    return deviation * deviation / (sigma * sigma);
  };
  double cost = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto e = static_cast<Eigen::Index>(k);
    cost += prior(kTheta + k, k < 2 ? kTiltPrior : kPinned, 0.0);
    cost += prior(kXiP + k, kPinned, 0.0);
    cost += prior(kXiV + k, kVelocityPrior, core.motion.v_WI_m_s(e));
    cost += prior(kGyroBias + k, options_.start.gyro_bias_sigma_rad_s, core.b_gyro_rad_s(e));
    cost += prior(kAccelBias + k, options_.start.accel_bias_sigma_m_s2, core.b_accel_m_s2(e));
  }
  return cost;
}

// The feature is where the anchor image saw it but for that image's own noise, the same in every row: left out, the
// rows would be taken for independent, the anchor for exact, and the velocity for three times as sure as it is. So the
// two unknowns "by how much the anchor observation is off" are eliminated here, feature by feature.
double MotionStart::add_feature(const StartProblem& problem, std::size_t index, double rho) {
  const StartFeature& feature = problem.features[index];
  const Station& anchor = images_[problem.images.size() - 1];
  const std::size_t column = kCoreSize + index;
  const double guess = guessed_inverse_depth(problem);
  const double information = 1.0 / (kDepthPrior * kDepthPrior * guess * guess);
  a_.view()(column, column) += information;
  b_[column] -= information * (rho - guess);

  FixedVector<FeatureRows, kMaxStartImages> rows;
  for (const StartObservation& seen : feature.earlier) {
    const Station& station = images_[seen.image];
    VisualPrediction p;
    const FeatureParameters parameters(feature.anchor_z.x(), feature.anchor_z.y(), rho);
    if (!ok(predict_feature(station.camera, anchor.camera, parameters, p))) {
      return std::numeric_limits<double>::infinity();
    }
    FeatureRows row;
    row.residual = (seen.z - p.z) / sigma_;
    row.by_core = p.by_pose * (station.by_start - anchor.by_start) / sigma_;
    row.by_anchor = p.by_feature.leftCols<2>();  // of an error in sigmas, like the residual
    row.by_depth = p.by_feature.col(2) / sigma_;
    static_cast<void>(rows.push_back(row));
  }
  const AnchorFit fit = fit_anchor({rows.data(), rows.size()});
  double cost = information * (rho - guess) * (rho - guess) + robust_cost(fit.offset.norm());
  squared_residuals_ += fit.weight * fit.offset.squaredNorm();
  for (FeatureRows& row : rows) {
    const double length = (row.residual - row.by_anchor * fit.offset).norm();
    row.weight = robust_weight(length);
    cost += robust_cost(length);
    squared_residuals_ += row.weight * length * length;
    residuals_ += 2;
  }
  add_rows({rows.data(), rows.size()}, fit.weight, column);
  return cost;
}

MotionStart::AnchorFit MotionStart::fit_anchor(std::span<const FeatureRows> rows) {
  constexpr int kReweightings = 2;
  AnchorFit fit;
  for (int i = 0; i < kReweightings; ++i) {
    Mat2 normal = fit.weight * Mat2::Identity();
    Vec2 right = Vec2::Zero();
    for (const FeatureRows& row : rows) {
      const double weight = robust_weight((row.residual - row.by_anchor * fit.offset).norm());
      normal += weight * row.by_anchor.transpose() * row.by_anchor;
      right += weight * row.by_anchor.transpose() * row.residual;
    }
    fit.offset = normal.inverse() * right;
    fit.weight = robust_weight(fit.offset.norm());
  }
  return fit;
}

void MotionStart::add_rows(std::span<const FeatureRows> rows, double anchor_weight, std::size_t column) {
  // With H the rows by core and depth, J those by the anchor's offset and W their weights:
  //   A += H^T W H - G^T N^-1 G,  b += H^T W r - G^T N^-1 J^T W r,  where G = J^T W H and N = J^T W J + w_anchor I.
  using RowsBy = Eigen::Matrix<double, 2, kCoreSize + 1, Eigen::RowMajor>;
  constexpr Eigen::Index kDepth = kCoreSize;
  Eigen::Matrix<double, kCoreSize + 1, kCoreSize + 1> a = Eigen::Matrix<double, kCoreSize + 1, kCoreSize + 1>::Zero();
  Eigen::Matrix<double, kCoreSize + 1, 1> b = Eigen::Matrix<double, kCoreSize + 1, 1>::Zero();
  RowsBy g = RowsBy::Zero();
  Mat2 n = anchor_weight * Mat2::Identity();
  Vec2 jr = Vec2::Zero();
  for (const FeatureRows& row : rows) {
    RowsBy h;
    h.leftCols<kCoreSize>() = row.by_core;
    h.col(kDepth) = row.by_depth;
    a.noalias() += row.weight * h.transpose().lazyProduct(h);
    b.noalias() += row.weight * h.transpose().lazyProduct(row.residual);
    g.noalias() += row.weight * row.by_anchor.transpose().lazyProduct(h);
    n += row.weight * row.by_anchor.transpose() * row.by_anchor;
    jr += row.weight * row.by_anchor.transpose() * row.residual;
  }
  const Mat2 inverse = n.inverse();
  const RowsBy inverse_g = inverse * g;
  a.noalias() -= g.transpose().lazyProduct(inverse_g);
  b.noalias() -= inverse_g.transpose().lazyProduct(jr);
  MatrixView normal = a_.view();
  for (std::size_t r = 0; r < kCoreSize; ++r) {
    const auto row = static_cast<Eigen::Index>(r);
    for (std::size_t c = 0; c <= r; ++c) normal(r, c) += a(row, static_cast<Eigen::Index>(c));
    normal(column, r) += a(kDepth, row);
    b_[r] += b(row);
  }
  normal(column, column) += a(kDepth, kDepth);
  b_[column] += b(kDepth);
}

double MotionStart::add_range(const StartProblem& problem, std::size_t index, const Estimate& estimate) {
  // The impact point, seen from the anchor image, must have the inverse depth of the facet it falls into there: inverse
  // depth is affine in image coordinates over a plane.
  const CameraPose& camera = ranges_[index].camera;
  const CameraPose& anchor = images_[problem.images.size() - 1].camera;
  const Vec3 impact_C = calibration_.impact_C_m(problem.ranges[index].range_m);
  const Vec3 h = anchor.R_WC.transpose() * (camera.p_WC_m + camera.R_WC * impact_C - anchor.p_WC_m);
  if (!(h.z() > 0.0)) {
    static_cast<void>(range_outcomes_.push_back(RangeOutcome::kBadGeometry));
    return 0.0;
  }
  const Vec2 query = h.head<2>() / h.z();
  const double measured = 1.0 / h.z();
  const Surface surface = surface_at(problem, query);
  const auto by_depth_less = [&](std::size_t a, std::size_t b) { return estimate.rho[a] < estimate.rho[b]; };
  const auto [farthest, nearest] = std::minmax_element(surface.features.begin(), surface.features.end(), by_depth_less);
  const double spread = estimate.rho[*nearest] - estimate.rho[*farthest];
  const double sigma = exact::hypot(surface.relative_error * measured, kFacetRelief * spread);
  double residual = measured;
  std::array<double, 3> by_depth{};
  std::array<std::size_t, 3> columns{};
  for (std::size_t j = 0; j < 3; ++j) {
    residual -= surface.weights(static_cast<Eigen::Index>(j)) * estimate.rho[surface.features[j]];
    columns[j] = kCoreSize + surface.features[j];
    by_depth[j] = surface.weights(static_cast<Eigen::Index>(j)) / sigma;
  }
  const double length = std::abs(residual) / sigma;
  static_cast<void>(range_outcomes_.push_back(length < kHuber ? RangeOutcome::kUsed : RangeOutcome::kGated));
  const double weight = robust_weight(length);
  MatrixView a = a_.view();
  for (std::size_t k = 0; k < 3; ++k) {
    for (std::size_t m = 0; m < 3; ++m) {
      if (columns[m] <= columns[k]) a(columns[k], columns[m]) += weight * by_depth[k] * by_depth[m];
    }
    b_[columns[k]] += weight * by_depth[k] * residual / sigma;
  }
  return robust_cost(length);
}

bool MotionStart::solve_step(double damping, std::size_t unknowns, double* step) {
  MatrixView l = factor_.view(unknowns, unknowns);
  const ConstMatrixView a = a_.view();
  for (std::size_t r = 0; r < unknowns; ++r) {
    for (std::size_t c = 0; c <= r; ++c) l(r, c) = a(r, c);
    l(r, r) *= 1.0 + damping;
    step[r] = b_[r];
  }
  if (!ok(cholesky_in_place(l))) return false;
  solve_lower_in_place(l, MatrixView(step, unknowns, 1, 1));
  solve_lower_transposed_in_place(l, step);
  return true;
}

bool MotionStart::core_covariance(std::size_t unknowns, Mat15& out) {
  double columns[kCoreSize][kMaxUnknowns];
  if (!solve_step(0.0, unknowns, columns[0])) return false;  // leaves the undamped factor behind
  const ConstMatrixView l = factor_.view(unknowns, unknowns);
  for (std::size_t k = 0; k < kCoreSize; ++k) {
    std::fill_n(columns[k], unknowns, 0.0);
    columns[k][k] = 1.0;
    solve_lower_in_place(l, MatrixView(columns[k], unknowns, 1, 1));
    for (std::size_t j = 0; j <= k; ++j) {
      double sum = 0.0;
      for (std::size_t i = 0; i < unknowns; ++i) sum += columns[j][i] * columns[k][i];
      out(static_cast<Eigen::Index>(j), static_cast<Eigen::Index>(k)) = sum;
      out(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(j)) = sum;
    }
  }
  return true;
}

}  // namespace plumb
