#pragma once
// The ranged facet (paper eq. 9 and 10): the laser hits the plane through three features. Written with the barycentric
// coordinates lambda_j of the impact point, the whole row is n^T / b times {-1 for the camera, lambda_j for feature j}.
// With one feature instead of three the plane is the one through it across the beam, n = u.

#include <array>
#include <span>

#include "fsw/base/status.h"
#include "fsw/estimator/visual_model.h"

namespace plumb {

/// The beam in the camera frame.
struct Beam {
  Vec3 p_CR_m = Vec3::Zero();  ///< origin of the range finder in C
  Vec3 u_C = Vec3::UnitZ();    ///< unit direction in C
};

struct FacetVertex {
  CameraPose anchor;
  FeatureParameters feature = FeatureParameters::Zero();
};
using Facet = std::array<FacetVertex, 3>;

struct RangePrediction {
  double range_m = 0.0;
  double cos_incidence = 0.0;       ///< |u . n| / |n|: 1 when the beam hits square
  Vec3 lambda = Vec3::Zero();       ///< barycentric coordinates of the impact, sum 1; (1, 0, 0) on one feature
  Row6 by_camera = Row6::Zero();    ///< d range / d (theta, xi_p) of the camera (or of the IMU carrying it)
  std::array<Row6, 3> by_anchor{};  ///< d range / d (theta, xi_p) of each vertex's anchor
  Eigen::RowVector3d by_origin = Eigen::RowVector3d::Zero();     ///< d range / d p_CR
  Eigen::RowVector3d by_direction = Eigen::RowVector3d::Zero();  ///< d range / d u_C, along the unit sphere
  std::array<Eigen::RowVector3d, 3> by_feature{};                ///< d range / d (alpha, beta, rho) of each vertex
};

/// `surface`: one feature or three. kIllConditioned: the three are in line, or the beam grazes their plane;
/// kInvalidValue: a vertex without positive depth, or the plane is hit behind the range finder.
Status predict_range(const CameraPose& camera, const Beam& beam, std::span<const FacetVertex> surface,
                     RangePrediction& out);

}  // namespace plumb
