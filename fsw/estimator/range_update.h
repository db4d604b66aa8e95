#pragma once
// One range into the filter, at its own time: the facet under the beam, the checks, the gate, the one-row update.

#include <algorithm>
#include <numbers>

#include "fsw/estimator/chi_square.h"
#include "fsw/estimator/facet_relief.h"
#include "fsw/estimator/range_model.h"
#include "fsw/estimator/report.h"
#include "fsw/estimator/update_stack.h"
#include "fsw/math/exact.h"

namespace plumb {

template <class Config>
class RangeUpdate {
 public:
  using Layout = ErrorLayout<Config>;

  explicit RangeUpdate(const RangeOptions& options)
      : options_(options), gate_(options.gate_sigma * options.gate_sigma), gate_cost_(gate_cost(gate_, 1)) {}
  /// Other options from here on.
  void use(const RangeOptions& options) {
    options_ = options;
    gate_ = options.gate_sigma * options.gate_sigma;
    gate_cost_ = gate_cost(gate_, 1);
  }

  /// Forgets the facets of a flight that has been reset.
  void clear() { repeats_.clear(); }
  /// What is remembered from range to range.
  void add_to(Hash64& hash) const { repeats_.add_to(hash); }
  /// Compares the range with the facet under the beam. Precondition: the state stands at the time of the range. Says in
  /// the report what became of it. kNumericalFault only when the covariance is unsound.
  Status fuse(FilterState<Config>& state, UpdateStack<Config>& stack, double range_m, FrameReport& report);
  /// The same with one feature at the laser's spot, `off_m` beside it: nothing is asked of the ground but its slope.
  Status fuse_on_feature(FilterState<Config>& state, UpdateStack<Config>& stack, std::size_t feature, double off_m,
                         double range_m, FrameReport& report) const;

 private:
  /// A vertex must be known this well: sigma of rho over rho. A feature just started from a prior passes.
  static constexpr double kMaxDepthUncertainty = 0.75;
  using Vertices = FixedVector<std::size_t, 3>;

  /// The facet that was hit.
  struct Target {
    Vertices vertices;
    Vec3 impact_W_m = Vec3::Zero();
    double size_m = 0.0;    ///< mean edge of the facet, on the ground
    double relief_m = 0.0;  ///< of the ground about it, along the beam, 1 sigma
  };

  void gather(const FilterState<Config>& state, const CameraPose& camera);
  Result<Target> facet_under_beam(const FilterState<Config>& state, const CameraPose& camera, double range_m);
  RangeOutcome add_row(const FilterState<Config>& state, UpdateStack<Config>& stack, const CameraPose& camera,
                       const Vertices& vertices, double sigma_m, double range_m, FrameReport& report) const;

  RangeOptions options_;
  double gate_;       ///< squared Mahalanobis distance
  double gate_cost_;  ///< a gate at two sigma refuses one good range in 22, which the others pay for
  SeenFeatures<Config> seen_;
  FacetRepeats repeats_;
};

template <class Config>
Status RangeUpdate<Config>::fuse(FilterState<Config>& state, UpdateStack<Config>& stack, double range_m,
                                 FrameReport& report) {
  const CameraPose camera = state.calibration().camera(state.core.motion);
  gather(state, camera);
  const Result<Target> target = facet_under_beam(state, camera, range_m);
  if (!target) {
    report.range_outcome = target.status() == Status::kRejected ? RangeOutcome::kBadGeometry : RangeOutcome::kNoFacet;
    return Status::kOk;
  }
  for (std::size_t j = 0; j < 3; ++j) report.range_facet[j] = state.features[target->vertices[j]].track_id;
  stack.begin(state);
  const double sigma_m =
      std::sqrt(repeats_.variance(target->impact_W_m, target->size_m, options_.noise_m, target->relief_m));
  report.range_outcome = add_row(state, stack, camera, target->vertices, sigma_m, range_m, report);
  if (report.range_outcome != RangeOutcome::kUsed) return Status::kOk;
  repeats_.used(target->impact_W_m);
  ++report.ranges_used;
  return stack.apply(state);
}

template <class Config>
Status RangeUpdate<Config>::fuse_on_feature(FilterState<Config>& state, UpdateStack<Config>& stack, std::size_t feature,
                                            double off_m, double range_m, FrameReport& report) const {
  Vertices vertices;
  static_cast<void>(vertices.push_back(feature));
  report.range_feature = state.features[feature].track_id;
  const double sigma_m = exact::hypot(options_.noise_m, options_.feature_slope * off_m);
  stack.begin(state);
  report.range_outcome =
      add_row(state, stack, state.calibration().camera(state.core.motion), vertices, sigma_m, range_m, report);
  if (report.range_outcome != RangeOutcome::kUsed) return Status::kOk;
  ++report.ranges_used;
  return stack.apply(state);
}

template <class Config>
void RangeUpdate<Config>::gather(const FilterState<Config>& state, const CameraPose& camera) {
  seen_.clear();
  const ConstMatrixView p = state.covariance();
  for (std::size_t i = 0; i < state.features.size(); ++i) {
    const SlamFeature& feature = state.features[i];
    const double rho = feature.parameters.z();
    const double sigma = std::sqrt(p(Layout::feature(i) + 2, Layout::feature(i) + 2));
    if (!(rho > 0.0) || !(sigma <= kMaxDepthUncertainty * rho)) continue;
    VisualPrediction seen;
    if (!ok(predict_feature(camera, state.pose(feature.anchor_slot).camera, feature.parameters, seen))) continue;
    seen_.add(seen.z, rho / seen.depth_times_rho, i);
  }
}

template <class Config>
Result<typename RangeUpdate<Config>::Target> RangeUpdate<Config>::facet_under_beam(const FilterState<Config>& state,
                                                                                   const CameraPose& camera,
                                                                                   double range_m) {
  const Vec3 impact_C = state.calibration().sensors().impact_C_m(range_m);
  if (!(impact_C.z() > 0.0)) return Status::kRejected;
  const Vec2 query = impact_C.head<2>() / impact_C.z();
  const Result<FacetChoice> facet = find_facet({seen_.points.data(), seen_.points.size()}, query);
  if (!facet) return facet.status();
  Target target;
  target.impact_W_m = camera.p_WC_m + camera.R_WC * impact_C;
  for (std::size_t j = 0; j < 3; ++j) {
    const Vec2 edge = seen_.points[facet->vertices[j]] - seen_.points[facet->vertices[(j + 1) % 3]];
    if (edge.norm() > options_.max_facet_edge) return Status::kRejected;
    target.size_m += edge.norm() * impact_C.z() / 3.0;
    static_cast<void>(target.vertices.push_back(seen_.feature[facet->vertices[j]]));
  }
  if (options_.relief)
    target.relief_m = FacetPlane<Config>(state, seen_, *facet).relief_m(query, range_m, target.size_m);
  return target;
}

template <class Config>
RangeOutcome RangeUpdate<Config>::add_row(const FilterState<Config>& state, UpdateStack<Config>& stack,
                                          const CameraPose& camera, const Vertices& vertices, double sigma_m,
                                          double range_m, FrameReport& report) const {
  constexpr double kRadPerDeg = std::numbers::pi / 180.0;
  FixedVector<FacetVertex, 3> surface;
  for (const std::size_t vertex : vertices) {
    const SlamFeature& feature = state.features[vertex];
    static_cast<void>(surface.push_back({state.pose(feature.anchor_slot).camera, feature.parameters}));
  }
  const SensorCalibration& sensors = state.calibration().sensors();
  RangePrediction prediction;
  if (!ok(predict_range(camera, {sensors.p_CR_m, sensors.u_C}, {surface.data(), surface.size()}, prediction)))
    return RangeOutcome::kBadGeometry;
  report.range_predicted_m = prediction.range_m;
  if (prediction.cos_incidence < exact::cos(options_.max_incidence_deg * kRadPerDeg)) return RangeOutcome::kBadGeometry;

  // The inverse of the range is fused: over a plane it is linear in the inverse depths of the vertices, so that the
  // update is right even while those are hardly known. 1/z - 1/h(x), noise sigma/z^2, Jacobian -J/h^2, all divided by
  // the noise, is the plain row times z^2/h^2 and the plain residual times z/h.
  const double ratio = range_m / prediction.range_m;
  MatrixView h = stack.open(1);
  Support support;
  const auto add = [&](std::size_t at, const auto& row) {  // anchors may coincide: contributions add up
    for (Eigen::Index k = 0; k < row.size(); ++k)
      h(0, at + static_cast<std::size_t>(k)) += ratio * ratio * row(k) / sigma_m;
  };
  add(kTheta, prediction.by_camera);  // the camera is fixed to the IMU: both have the same (theta, xi_p)
  static_cast<void>(support.push_back({kTheta, kPoseSize}));
  if (state.estimates_camera()) {  // on the IMU's clock the range has its time: no part of it is the image's offset
    const Mat67 by_mount = state.calibration().camera_by_mount(state.core.motion, Vec3::Zero());
    add(Layout::kCameraMount + 1, (prediction.by_camera * by_mount.rightCols<6>()).eval());
  }
  if (state.estimates_beam()) {
    add(Layout::kBeam, (prediction.by_direction * state.calibration().beam_by_tilt()).eval());
    add(Layout::kBeam + 2, prediction.by_origin);
  }
  if constexpr (Layout::kPoses > Layout::kCameraMount)
    static_cast<void>(support.push_back({Layout::kCameraMount, Layout::kPoses - Layout::kCameraMount}));
  for (std::size_t j = 0; j < vertices.size(); ++j) {
    const std::size_t anchor = Layout::pose(state.features[vertices[j]].anchor_slot);
    const bool seen = std::any_of(support.begin(), support.end(), [&](const Segment& s) { return s.start == anchor; });
    if (!seen) static_cast<void>(support.push_back({anchor, kPoseSize}));
    add(anchor, prediction.by_anchor[j]);
    add(Layout::feature(vertices[j]), prediction.by_feature[j]);
    static_cast<void>(support.push_back({Layout::feature(vertices[j]), kFeatureSize}));
  }
  stack.residual(0) = ratio * (range_m - prediction.range_m) / sigma_m;
  const double nis = stack.close(state, support);
  report.range_sigma_m = sigma_m * std::sqrt(stack.innovation_variance(0)) / ratio;
  if (!(nis <= gate_)) return RangeOutcome::kGated;
  stack.weaken(1, gate_cost_);
  return RangeOutcome::kUsed;
}

}  // namespace plumb
