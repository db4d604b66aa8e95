#pragma once
// How a camera in the window sees a feature anchored in another pose of the window (paper eq. 3 to 5), with Jacobians
// for the right-invariant error. One function serves SLAM features, MSCKF tracks and triangulation.

#include "fsw/base/status.h"
#include "fsw/estimator/error_state.h"

namespace plumb {

/// A camera pose: R_WC rotates from C to W, p_WC_m is the camera centre in W.
struct CameraPose {
  Mat3 R_WC = Mat3::Identity();
  Vec3 p_WC_m = Vec3::Zero();
};

/// An inverse-depth feature in its anchor camera: direction (alpha, beta, 1), rho = 1 / depth along z [1/m].
using FeatureParameters = Vec3;

struct VisualPrediction {
  Vec2 z = Vec2::Zero();             ///< normalised image plane of the observing camera
  double depth_times_rho = 0.0;      ///< depth along z of the observing camera, times rho; positive when in front
  Mat26 by_pose = Mat26::Zero();     ///< dz / d(theta, xi_p) of the observing pose; the anchor's is the negative
  Mat23 by_feature = Mat23::Zero();  ///< dz / d(alpha, beta, rho)
};

/// kInvalidValue when the feature is not in front of the observing camera. rho may be zero (a point at infinity).
Status predict_feature(const CameraPose& camera, const CameraPose& anchor, const FeatureParameters& feature,
                       VisualPrediction& out);

/// The feature as a point in W. Precondition: rho > 0.
Vec3 feature_in_world(const CameraPose& anchor, const FeatureParameters& feature);

/// Re-expresses a feature in the camera `to`. kInvalidValue when it is not in front of that camera or rho <= 0.
/// `by_from` and `by_to` are 3 x 6 on (theta, xi_p) of the old and new anchor, `by_feature` is on the old parameters.
struct Reanchoring {
  FeatureParameters feature = FeatureParameters::Zero();
  Eigen::Matrix<double, 3, 6, Eigen::RowMajor> by_from;
  Eigen::Matrix<double, 3, 6, Eigen::RowMajor> by_to;
  Mat3 by_feature = Mat3::Zero();
};
Status reanchor_feature(const CameraPose& from, const CameraPose& to, const FeatureParameters& feature,
                        Reanchoring& out);

}  // namespace plumb
