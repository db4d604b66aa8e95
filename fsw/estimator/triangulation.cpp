#include "fsw/estimator/triangulation.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace plumb {
namespace {

constexpr int kMaxIterations = 8;
constexpr double kConverged = 1e-9;  // step length, relative to the parameters
constexpr double kMaxDamping = 1e6;

/// Depth along the anchor's ray by linear least squares: in each view z x R^T(rho (p_a - p_c) + d) = 0.
double linear_inverse_depth(const Views& views, std::size_t anchor) {
  const CameraPose& a = views[anchor].camera;
  const Vec3 direction = a.R_WC * views[anchor].z.homogeneous();
  double numerator = 0.0;
  double denominator = 0.0;
  for (const View& view : views) {
    const Vec3 z = view.z.homogeneous().normalized();
    const Vec3 by_rho = z.cross(view.camera.R_WC.transpose() * (a.p_WC_m - view.camera.p_WC_m));
    const Vec3 constant = z.cross(view.camera.R_WC.transpose() * direction);
    numerator -= by_rho.dot(constant);
    denominator += by_rho.squaredNorm();
  }
  return denominator > 0.0 ? numerator / denominator : 0.0;
}

struct NormalEquations {
  Mat3 a = Mat3::Zero();
  Vec3 b = Vec3::Zero();
  double cost = 0.0;
  bool in_front = true;
};

void add_known_depth(const Views& views, std::size_t anchor, const FeatureParameters& feature, const KnownDepth& known,
                     NormalEquations& n) {
  Reanchoring there;
  n.in_front = ok(reanchor_feature(views[anchor].camera, views[known.view].camera, feature, there));
  if (!n.in_front) return;
  const Vec3 row = known.weight * there.by_feature.row(2).transpose();
  const double r = known.weight * (known.rho_1_m - there.feature.z());
  n.a += row * row.transpose();
  n.b += row * r;
  n.cost += r * r;
}

NormalEquations linearise(const Views& views, std::size_t anchor, const FeatureParameters& feature,
                          const KnownDepth* known) {
  NormalEquations n;
  for (const View& view : views) {
    VisualPrediction prediction;
    if (!ok(predict_feature(view.camera, views[anchor].camera, feature, prediction))) {
      n.in_front = false;
      return n;
    }
    const Vec2 r = view.z - prediction.z;
    n.a += prediction.by_feature.transpose() * prediction.by_feature;
    n.b += prediction.by_feature.transpose() * r;
    n.cost += r.squaredNorm();
  }
  if (known != nullptr) add_known_depth(views, anchor, feature, *known, n);
  return n;
}

/// Where to start from: the ray of the anchor and the depth that fits all views best, or the point that the range says.
FeatureParameters first_guess(const Views& views, std::size_t anchor, const KnownDepth* known) {
  const Vec2& z = views[anchor].z;
  if (known == nullptr) return {z.x(), z.y(), linear_inverse_depth(views, anchor)};
  const View& there = views[known->view];
  Reanchoring here;
  const FeatureParameters ranged(there.z.x(), there.z.y(), known->rho_1_m);
  const bool in_front = ok(reanchor_feature(there.camera, views[anchor].camera, ranged, here));
  return in_front ? here.feature : FeatureParameters::Zero();
}

}  // namespace

double parallax(const Views& views, std::size_t anchor) {
  const CameraPose& a = views[anchor].camera;
  double largest = 0.0;
  for (const View& view : views) {
    const Vec3 h = a.R_WC.transpose() * (view.camera.R_WC * view.z.homogeneous());
    if (!(h.z() > 0.0)) continue;
    largest = std::max(largest, (h.head<2>() / h.z() - views[anchor].z).norm());
  }
  return largest;
}

Result<FeatureParameters> triangulate(const Views& views, std::size_t anchor, const TriangulationLimits& limits,
                                      const KnownDepth* known) {
  PLUMB_ASSERT(views.size() >= 2 && anchor < views.size());
  if (known == nullptr && parallax(views, anchor) < limits.min_parallax) return Status::kIllConditioned;
  FeatureParameters feature = first_guess(views, anchor, known);
  if (!(feature.z() > 0.0)) return Status::kRejected;
  NormalEquations now = linearise(views, anchor, feature, known);
  if (!now.in_front) return Status::kRejected;
  double damping = 1e-4;
  for (int i = 0; i < kMaxIterations && damping < kMaxDamping; ++i) {
    Mat3 a = now.a;
    a.diagonal() *= 1.0 + damping;
    const Vec3 step = a.ldlt().solve(now.b);
    const FeatureParameters trial = feature + step;
    const NormalEquations next = linearise(views, anchor, trial, known);
    if (!next.in_front || !(next.cost <= now.cost)) {  // a step that does not lower the cost is not taken
      damping *= 10.0;
      continue;
    }
    feature = trial;
    now = next;
    damping *= 0.1;
    if (step.squaredNorm() <= kConverged * kConverged * feature.squaredNorm()) break;
  }
  const double rows = 2.0 * static_cast<double>(views.size()) + (known != nullptr ? 1.0 : 0.0);
  const double rms = std::sqrt(now.cost / rows);
  if (!feature.allFinite() || !(rms <= limits.max_rms)) return Status::kRejected;
  const double rho = feature.z();
  if (!(rho * limits.max_depth_m >= 1.0) || !(rho * limits.min_depth_m <= 1.0)) return Status::kRejected;
  return feature;
}

}  // namespace plumb
