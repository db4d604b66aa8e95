#include "fsw/estimator/range_model.h"

#include <algorithm>
#include <cmath>

#include "fsw/base/assert.h"

namespace plumb {
namespace {
constexpr double kMinCosIncidence = 0.02;
constexpr double kMinRelativeArea = 1e-9;  // |n| against the squared longest edge: below it the vertices are in line

/// Of the plane through three points, not normalised.
Result<Vec3> normal_of(const std::array<Vec3, 3>& f) {
  const Vec3 e1 = f[0] - f[1];
  const Vec3 e3 = f[2] - f[1];
  const Vec3 n = e1.cross(e3);
  const double edge2 = std::max({e1.squaredNorm(), e3.squaredNorm(), (f[0] - f[2]).squaredNorm()});
  if (!(n.squaredNorm() > kMinRelativeArea * edge2 * edge2)) return Status::kIllConditioned;
  return n;
}

/// Barycentric coordinates of a point of that plane.
Vec3 lambda_of(const std::array<Vec3, 3>& f, const Vec3& n, const Vec3& point) {
  const double n2 = n.squaredNorm();
  const double first = n.dot((point - f[1]).cross(f[2] - f[1])) / n2;
  const double last = n.dot((f[0] - f[1]).cross(point - f[1])) / n2;
  return {first, 1.0 - first - last, last};
}

}  // namespace

Status predict_range(const CameraPose& camera, const Beam& beam, std::span<const FacetVertex> surface,
                     RangePrediction& out) {
  PLUMB_ASSERT(surface.size() == 1 || surface.size() == 3);
  std::array<Vec3, 3> f;
  for (std::size_t j = 0; j < surface.size(); ++j) {
    if (!(surface[j].feature.z() > 0.0)) return Status::kInvalidValue;
    f[j] = feature_in_world(surface[j].anchor, surface[j].feature);
  }
  const Vec3 origin = camera.p_WC_m + camera.R_WC * beam.p_CR_m;
  const Vec3 u = camera.R_WC * beam.u_C;
  Vec3 n = u;
  if (surface.size() == 3) {
    const Result<Vec3> normal = normal_of(f);
    if (!normal) return normal.status();
    n = *normal;
  }
  const double b = u.dot(n);
  out.cos_incidence = std::abs(b) / n.norm();
  if (!(out.cos_incidence > kMinCosIncidence)) return Status::kIllConditioned;
  out.range_m = (f[surface.size() / 2] - origin).dot(n) / b;
  if (!(out.range_m > 0.0)) return Status::kInvalidValue;

  const Vec3 impact = origin + out.range_m * u;
  out.lambda = surface.size() == 3 ? lambda_of(f, n, impact) : Vec3::UnitX();

  // A rigid displacement (theta, xi) of a pose moves a point X fixed to it by xi - [X]x theta.
  const Eigen::RowVector3d row = n.transpose() / b;
  out.by_camera << row * skew(impact), -row;
  out.by_origin = -row * camera.R_WC;
  out.by_direction = out.range_m * out.by_origin;
  for (std::size_t j = 0; j < surface.size(); ++j) {
    const double lambda = out.lambda(static_cast<Eigen::Index>(j));
    const FeatureParameters& p = surface[j].feature;
    Mat3 by_parameters;
    by_parameters << 1.0, 0.0, -p.x() / p.z(), 0.0, 1.0, -p.y() / p.z(), 0.0, 0.0, -1.0 / p.z();
    out.by_anchor[j] << -lambda * row * skew(f[j]), lambda * row;
    out.by_feature[j] = (lambda / p.z()) * row * surface[j].anchor.R_WC * by_parameters;
  }
  return Status::kOk;
}

}  // namespace plumb
