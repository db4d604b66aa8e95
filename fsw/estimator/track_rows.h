#pragma once
// The rows of one feature track that is not in the state (paper section III-B, MSCKF): all its observations stacked,
// the feature's own columns taken out by an orthogonal transformation. What is left sees poses only; what was taken out
// is the start of a SLAM feature, should it become one (delayed initialisation). A ranged track has one row more: its
// inverse depth in the image that belongs to the range.

#include <algorithm>
#include <array>
#include <limits>

#include "fsw/estimator/covariance.h"
#include "fsw/estimator/options.h"
#include "fsw/estimator/triangulation.h"
#include "fsw/math/kernels.h"

namespace plumb {

/// Columns of the work matrix: feature, then the beam's calibration if there is room for it (BeamColumns 5 or 0), then
/// the window's pose slots, then the residual. Beam and poses are one run of columns, as in the error state.
template <std::size_t MaxPoses, std::size_t BeamColumns = 0>
struct TrackRows {
  static constexpr std::size_t kBeamColumns = BeamColumns;
  static constexpr std::size_t kPoseColumns = BeamColumns + kPoseSize * MaxPoses;  ///< beam included
  static constexpr std::size_t kColumns = kFeatureSize + kPoseColumns + 1;
  static constexpr std::size_t kMaxRows = 2 * MaxPoses + 1;

  FeatureParameters feature = FeatureParameters::Zero();
  std::size_t anchor_slot = 0;
  std::size_t rows = 0;                       ///< of the whole stack; the first three of `work` determine the feature
  MatrixStorage<kMaxRows, kColumns> stacked;  ///< the rows as they are observed: each sees two poses
  std::array<Support, kMaxRows> support;      ///< of each of these, among beam and poses
  MatrixStorage<kMaxRows, kColumns> work;     ///< the same, the feature taken out of all but three

  static constexpr std::size_t pose(std::size_t slot) { return kFeatureSize + BeamColumns + kPoseSize * slot; }
  void add_support(std::size_t row, std::size_t slot) {
    static_cast<void>(support[row].push_back({pose(slot) - kFeatureSize, kPoseSize}));
  }
  /// The rows that see no feature: (rows - 3) x (beam, poses | residual).
  MatrixView pose_rows() {
    return work.view().block(kFeatureSize, kFeatureSize, rows - kFeatureSize, kPoseColumns + 1);
  }
  /// The rows that determine the feature: 3 x (feature upper triangle | beam, poses | residual).
  ConstMatrixView feature_rows() const { return work.view().block(0, 0, kFeatureSize, kColumns); }
};

/// The last row of a ranged track: its inverse depth in the view of the range, which is what reanchor_feature() gives
/// there, less what the beam's calibration does to the known depth.
template <std::size_t MaxPoses, std::size_t BeamColumns>
Status add_range_row(const Views& views, const KnownDepth& known, TrackRows<MaxPoses, BeamColumns>& out) {
  const View& anchor = views.back();
  const View& there = views[known.view];
  Reanchoring ranged;
  if (!ok(reanchor_feature(anchor.camera, there.camera, out.feature, ranged))) return Status::kRejected;
  MatrixView all = out.stacked.view(out.rows, out.kColumns);
  const std::size_t row = out.rows - 1;
  std::fill_n(all.row(row), all.cols(), 0.0);
  out.support[row].clear();
  all.template fixed<1, 3>(row, 0) = ranged.by_feature.row(2) / known.sigma_1_m;
  if (known.view != views.size() - 1) {
    all.template fixed<1, 6>(row, out.pose(there.pose_slot)) = ranged.by_to.row(2) / known.sigma_1_m;
    all.template fixed<1, 6>(row, out.pose(anchor.pose_slot)) = ranged.by_from.row(2) / known.sigma_1_m;
    out.add_support(row, there.pose_slot);
    out.add_support(row, anchor.pose_slot);
  }
  // The known depth stands on the other side of the equation.
  if constexpr (BeamColumns > 0) {
    all.template fixed<1, 5>(row, kFeatureSize) = -known.by_beam / known.sigma_1_m;
    static_cast<void>(out.support[row].push_back({0, BeamColumns}));
  }
  all(row, all.cols() - 1) = (known.rho_1_m - ranged.feature.z()) / known.sigma_1_m;
  return Status::kOk;
}

/// Triangulates and stacks, whitened by sigma (normalised plane). Fails as triangulate() does, or kIllConditioned when
/// the observations do not determine the feature's depth. `known`: the range of a ranged track, or null.
template <std::size_t MaxPoses, std::size_t BeamColumns>
Status build_track_rows(const Views& views, const TriangulationLimits& limits, double sigma,
                        TrackRows<MaxPoses, BeamColumns>& out, const KnownDepth* known = nullptr) {
  constexpr double kMinDepthInformation = 1e-3;  // diagonal of the whitened triangle; 1/m
  const std::size_t anchor = views.size() - 1;
  const Result<FeatureParameters> feature = triangulate(views, anchor, limits, known);
  if (!feature) return feature.status();
  out.feature = *feature;
  out.anchor_slot = views[anchor].pose_slot;
  out.rows = 2 * views.size() + (known != nullptr ? 1 : 0);
  MatrixView all = out.stacked.view(out.rows, out.kColumns);
  for (std::size_t i = 0; i < views.size(); ++i) {
    VisualPrediction prediction;
    if (!ok(predict_feature(views[i].camera, views[anchor].camera, out.feature, prediction))) return Status::kRejected;
    for (std::size_t r = 0; r < 2; ++r) {
      double* row = all.row(2 * i + r);
      std::fill_n(row, all.cols(), 0.0);
      out.support[2 * i + r].clear();
    }
    all.template fixed<2, 3>(2 * i, 0) = prediction.by_feature / sigma;
    if (i != anchor) {  // the anchor's own view has no pose columns: observer and anchor cancel
      all.template fixed<2, 6>(2 * i, out.pose(views[i].pose_slot)) = prediction.by_pose / sigma;
      all.template fixed<2, 6>(2 * i, out.pose(out.anchor_slot)) = -prediction.by_pose / sigma;
      for (std::size_t r = 0; r < 2; ++r) {
        out.add_support(2 * i + r, views[i].pose_slot);
        out.add_support(2 * i + r, out.anchor_slot);
      }
    }
    const Vec2 residual = (views[i].z - prediction.z) / sigma;
    all(2 * i, all.cols() - 1) = residual.x();
    all(2 * i + 1, all.cols() - 1) = residual.y();
  }
  if (known != nullptr && !ok(add_range_row(views, *known, out))) return Status::kRejected;
  MatrixView work = out.work.view(out.rows, out.kColumns);
  for (std::size_t r = 0; r < out.rows; ++r) std::copy_n(all.row(r), all.cols(), work.row(r));
  triangularise(work, kFeatureSize);
  for (std::size_t k = 0; k < kFeatureSize; ++k) {
    if (!(std::abs(work(k, k)) > kMinDepthInformation)) return Status::kIllConditioned;
  }
  return Status::kOk;
}

/// How far the pose rows are from what the prior leads to expect: r^T (H P H^T + I)^-1 r, chi-square in their number.
/// `poses` is the covariance of the beam and the pose slots. Not finite if that is unsound.
///
/// It is what is left of the stacked rows, whitened by their own innovation covariance S = L L^T, once the feature has
/// explained what it can: the least squares of L^-1 (F df - r). These rows see two poses each, the pose rows all.
template <std::size_t MaxPoses, std::size_t BeamColumns>
double innovation_squared(const TrackRows<MaxPoses, BeamColumns>& track, ConstMatrixView poses) {
  using Rows = TrackRows<MaxPoses, BeamColumns>;
  constexpr std::size_t kResidual = kFeatureSize;  // its column, behind those of the feature
  const std::size_t m = track.rows;
  const ConstMatrixView all = track.stacked.view().block(0, 0, m, Rows::kColumns);
  const ConstMatrixView h = all.block(0, kFeatureSize, m, Rows::kPoseColumns);
  double hp_storage[Rows::kMaxRows * Rows::kPoseColumns];
  double s_storage[Rows::kMaxRows * Rows::kMaxRows];
  double left_storage[Rows::kMaxRows * (kFeatureSize + 1)];
  MatrixView hp(hp_storage, m, Rows::kPoseColumns, Rows::kPoseColumns);
  MatrixView s(s_storage, m, m, Rows::kMaxRows);
  MatrixView left(left_storage, m, kFeatureSize + 1, kFeatureSize + 1);
  for (std::size_t i = 0; i < m; i += 2) {  // the two rows of a view see the same
    const std::size_t rows = std::min<std::size_t>(2, m - i);
    multiply_rows(h.block(i, 0, rows, h.cols()), track.support[i], poses, hp.block(i, 0, rows, hp.cols()));
  }
  for (std::size_t j = 0; j < m; ++j) {
    sum_products(hp.block(j, 0, m - j, hp.cols()), h.row(j), track.support[j],
                 MatrixView(&s(j, j), m - j, 1, s.stride()));
    s(j, j) += 1.0;
    std::copy_n(all.row(j), kFeatureSize, left.row(j));
    left(j, kResidual) = all(j, all.cols() - 1);
  }
  if (!ok(cholesky_in_place(s))) return std::numeric_limits<double>::quiet_NaN();
  solve_lower_in_place(s, left);
  triangularise(left, kFeatureSize);
  double nis = 0.0;
  for (std::size_t i = kFeatureSize; i < m; ++i) nis += left(i, kResidual) * left(i, kResidual);
  return nis;
}

}  // namespace plumb
