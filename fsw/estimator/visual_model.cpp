#include "fsw/estimator/visual_model.h"

namespace plumb {
namespace {
constexpr double kMinCosine = 0.05;  // a feature must lie within 87 degrees of the optical axis
}

Vec3 feature_in_world(const CameraPose& anchor, const FeatureParameters& feature) {
  const Vec3 m(feature.x(), feature.y(), 1.0);
  return anchor.p_WC_m + anchor.R_WC * m / feature.z();
}

Status predict_feature(const CameraPose& camera, const CameraPose& anchor, const FeatureParameters& feature,
                       VisualPrediction& out) {
  const double rho = feature.z();
  const Vec3 direction = anchor.R_WC * Vec3(feature.x(), feature.y(), 1.0);
  // Everything is scaled by rho, which leaves the projection unchanged and keeps points at infinity regular.
  const Vec3 baseline = anchor.p_WC_m - camera.p_WC_m;
  const Vec3 h = camera.R_WC.transpose() * (rho * baseline + direction);
  if (!(h.z() > kMinCosine * h.norm())) return Status::kInvalidValue;

  out.z = h.head<2>() / h.z();
  out.depth_times_rho = h.z();
  Mat23 by_h;
  by_h << 1.0, 0.0, -out.z.x(), 0.0, 1.0, -out.z.y();
  by_h /= h.z();
  const Mat23 by_world = by_h * camera.R_WC.transpose();
  out.by_pose.leftCols<3>() = by_world * skew(rho * anchor.p_WC_m + direction);
  out.by_pose.rightCols<3>() = -rho * by_world;
  out.by_feature.leftCols<2>() = by_world * anchor.R_WC.leftCols<2>();
  out.by_feature.col(2) = by_world * baseline;
  return Status::kOk;
}

Status reanchor_feature(const CameraPose& from, const CameraPose& to, const FeatureParameters& feature,
                        Reanchoring& out) {
  const double rho = feature.z();
  if (!(rho > 0.0)) return Status::kInvalidValue;
  const Vec3 m(feature.x(), feature.y(), 1.0);
  const Vec3 point = from.p_WC_m + from.R_WC * m / rho;
  const Vec3 h = to.R_WC.transpose() * (point - to.p_WC_m);
  if (!(h.z() > kMinCosine * h.norm())) return Status::kInvalidValue;

  const double rho_new = 1.0 / h.z();
  out.feature = Vec3(h.x() * rho_new, h.y() * rho_new, rho_new);
  Mat3 by_h;
  by_h << 1.0, 0.0, -out.feature.x(), 0.0, 1.0, -out.feature.y(), 0.0, 0.0, -rho_new;
  by_h *= rho_new;
  const Mat3 by_world = by_h * to.R_WC.transpose();
  out.by_to.leftCols<3>() = by_world * skew(point);
  out.by_to.rightCols<3>() = -by_world;
  out.by_from = -out.by_to;
  Mat3 by_parameters;
  by_parameters << 1.0, 0.0, -feature.x() / rho, 0.0, 1.0, -feature.y() / rho, 0.0, 0.0, -1.0 / rho;
  out.by_feature = by_world * from.R_WC * by_parameters / rho;
  return Status::kOk;
}

}  // namespace plumb
