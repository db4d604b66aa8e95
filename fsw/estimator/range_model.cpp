#include "fsw/estimator/range_model.h"

#include <algorithm>
#include <cmath>

namespace plumb {
namespace {
constexpr double kMinCosIncidence = 0.02;
constexpr double kMinRelativeArea = 1e-9;  // |n| against the squared longest edge: below it the vertices are in line
}  // namespace

Status predict_range(const CameraPose& camera, const Beam& beam, const Facet& facet, RangePrediction& out) {
  std::array<Vec3, 3> f;
  for (std::size_t j = 0; j < 3; ++j) {
    if (!(facet[j].feature.z() > 0.0)) return Status::kInvalidValue;
    f[j] = feature_in_world(facet[j].anchor, facet[j].feature);
  }
  const Vec3 origin = camera.p_WC_m + camera.R_WC * beam.p_CR_m;
  const Vec3 u = camera.R_WC * beam.u_C;
  const Vec3 e1 = f[0] - f[1];
  const Vec3 e3 = f[2] - f[1];
  const Vec3 n = e1.cross(e3);
  const double n2 = n.squaredNorm();
  const double edge2 = std::max({e1.squaredNorm(), e3.squaredNorm(), (f[0] - f[2]).squaredNorm()});
  if (!(n2 > kMinRelativeArea * edge2 * edge2)) return Status::kIllConditioned;
  const double b = u.dot(n);
  out.cos_incidence = std::abs(b) / std::sqrt(n2);
  if (!(out.cos_incidence > kMinCosIncidence)) return Status::kIllConditioned;
  out.range_m = (f[1] - origin).dot(n) / b;
  if (!(out.range_m > 0.0)) return Status::kInvalidValue;

  const Vec3 impact = origin + out.range_m * u;
  out.lambda(0) = n.dot((impact - f[1]).cross(e3)) / n2;
  out.lambda(2) = n.dot(e1.cross(impact - f[1])) / n2;
  out.lambda(1) = 1.0 - out.lambda(0) - out.lambda(2);

  // A rigid displacement (theta, xi) of a pose moves a point X fixed to it by xi - [X]x theta.
  const Eigen::RowVector3d row = n.transpose() / b;
  out.by_camera << row * skew(impact), -row;
  out.by_origin = -row * camera.R_WC;
  out.by_direction = out.range_m * out.by_origin;
  for (std::size_t j = 0; j < 3; ++j) {
    const double lambda = out.lambda(static_cast<Eigen::Index>(j));
    const FeatureParameters& p = facet[j].feature;
    Mat3 by_parameters;
    by_parameters << 1.0, 0.0, -p.x() / p.z(), 0.0, 1.0, -p.y() / p.z(), 0.0, 0.0, -1.0 / p.z();
    out.by_anchor[j] << -lambda * row * skew(f[j]), lambda * row;
    out.by_feature[j] = (lambda / p.z()) * row * facet[j].anchor.R_WC * by_parameters;
  }
  return Status::kOk;
}

}  // namespace plumb
