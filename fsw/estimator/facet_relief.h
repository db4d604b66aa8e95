#pragma once
// How well a facet stands for the ground under the beam. The paper takes the ground for flat between three features.
// Over steps it is not, and the error is not noise: it repeats from range to range until the beam is a facet further,
// so that a hundred ranges on one facet say hardly more than the first. What the features around the facet tell about
// the ground goes into the noise of the range, and what repeats is counted once.

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "fsw/estimator/facet_search.h"
#include "fsw/estimator/filter_state.h"
#include "fsw/math/exact.h"

namespace plumb {

/// The SLAM features a facet can be made of, seen from the camera at the time of the range.
template <class Config>
struct SeenFeatures {
  FixedVector<Vec2, Config::kMaxSlamFeatures> points;           ///< normalised image plane
  FixedVector<double, Config::kMaxSlamFeatures> inverse_depth;  ///< 1/m, along the optical axis
  FixedVector<std::size_t, Config::kMaxSlamFeatures> feature;   ///< index in the state

  void clear() {
    points.clear();
    inverse_depth.clear();
    feature.clear();
  }
  void add(const Vec2& point, double inverse_depth_1_m, std::size_t index) {
    static_cast<void>(points.push_back(point));
    static_cast<void>(inverse_depth.push_back(inverse_depth_1_m));
    static_cast<void>(feature.push_back(index));
  }
};

/// The plane through a facet's vertices, against which other features are held. Over a plane the inverse depth is
/// affine in image coordinates.
template <class Config>
class FacetPlane {
 public:
  FacetPlane(const FilterState<Config>& state, const SeenFeatures<Config>& seen, const FacetChoice& facet)
      : state_(state),
        seen_(seen),
        facet_(facet),
        barycentric_(barycentric({seen.points.data(), seen.points.size()}, facet)) {}

  /// By how much, 1 sigma along the beam in metres, the surface under the beam may lie off the facet: the six features
  /// nearest to it are taken as samples of a ground that scatters about a plane, as the vertices are. What their own
  /// uncertainty explains they do not tell, but it may hide as much, up to what ground has that is rough at the facet's
  /// size. Small over flat ground with features that are known.
  double relief_m(const Vec2& query, double range_m, double size_m) const {
    constexpr std::size_t kAsked = 6;
    struct Near {
      double distance2 = 0.0;
      std::size_t feature = 0;
    };
    FixedVector<Near, kAsked> nearest;  // in order of distance
    for (std::size_t i = 0; i < seen_.points.size(); ++i) {
      if (std::find(facet_.vertices.begin(), facet_.vertices.end(), i) != facet_.vertices.end()) continue;
      const double distance2 = (seen_.points[i] - query).squaredNorm();
      if (nearest.full() && distance2 >= nearest.back().distance2) continue;
      if (nearest.full()) nearest.pop_back();
      static_cast<void>(nearest.push_back({distance2, i}));
      for (std::size_t k = nearest.size() - 1; k > 0 && nearest[k - 1].distance2 > distance2; --k)
        std::swap(nearest[k - 1], nearest[k]);
    }
    const Vec3 weights = barycentric_ * query.homogeneous();
    const double inverse_depth = weights.dot(vertex_values());
    if (nearest.empty() || !(inverse_depth > 0.0)) return 0.0;
    Scatter sum;
    for (const Near& near : nearest) {
      const Scatter one = scatter(near.feature);
      sum.surface += one.surface;
      sum.uncertainty += one.uncertainty;
    }
    const double per_point = (1.0 + weights.squaredNorm()) / static_cast<double>(nearest.size());
    const double to_m = range_m / inverse_depth;
    const double seen_m2 = to_m * to_m * per_point * std::max(sum.surface, 0.0);
    const double hidden_m2 = to_m * to_m * per_point * sum.uncertainty;
    return std::sqrt(seen_m2 + std::min(hidden_m2, kMostHidden * kMostHidden * size_m * size_m));
  }

 private:
  Vec3 vertex_values() const {
    const auto& v = facet_.vertices;
    return {seen_.inverse_depth[v[0]], seen_.inverse_depth[v[1]], seen_.inverse_depth[v[2]]};
  }

  static constexpr double kMostHidden = 0.1;  // of the distance between features: rough ground

  /// Variance of one point's scatter about the plane, 1/m^2: what the surface has, and what the uncertainty of the
  /// features could hide.
  struct Scatter {
    double surface = 0.0;
    double uncertainty = 0.0;
  };
  /// As feature i tells it; the surface's is below zero when the feature lies closer than expected, so that the mean
  /// over features is not biased. Four points that scatter alike, one of them predicted from the others, miss by 1 +
  /// |weights|^2 times that, beside what the filter knows to be the uncertainty of the four.
  Scatter scatter(std::size_t i) const {
    const Vec3 weights = barycentric_ * seen_.points[i].homogeneous();
    const double misfit = seen_.inverse_depth[i] - weights.dot(vertex_values());
    std::array<std::size_t, 4> at{};  // rho of each in the error state
    Eigen::Vector4d by;               // the misfit by it
    for (std::size_t j = 0; j < 4; ++j) {
      const std::size_t point = j < 3 ? facet_.vertices[j] : i;
      const std::size_t feature = seen_.feature[point];
      const auto e = static_cast<Eigen::Index>(j);
      at[j] = ErrorLayout<Config>::feature(feature) + 2;
      by(e) = (j < 3 ? -weights(e) : 1.0) * seen_.inverse_depth[point] / state_.features[feature].parameters.z();
    }
    const ConstMatrixView p = state_.covariance();
    double explained = 0.0;
    for (std::size_t j = 0; j < 4; ++j) {
      for (std::size_t k = 0; k < 4; ++k)
        explained += by(static_cast<Eigen::Index>(j)) * by(static_cast<Eigen::Index>(k)) * p(at[j], at[k]);
    }
    const double share = 1.0 / (1.0 + weights.squaredNorm());
    return {(misfit * misfit - explained) * share, explained * share};
  }

  const FilterState<Config>& state_;
  const SeenFeatures<Config>& seen_;
  const FacetChoice& facet_;
  Mat3 barycentric_;
};

/// Remembers where the last range that was used hit the ground: the error of a facet stays while the beam stays, and is
/// another one a facet further.
class FacetRepeats {
 public:
  void clear() { last_W_m_.reset(); }
  void used(const Vec3& impact_W_m) { last_W_m_ = impact_W_m; }
  void add_to(Hash64& hash) const {
    if (last_W_m_) hash.add(last_W_m_->data(), 3);
  }

  /// Variance, m^2, of the white noise that carries as much information, range after range, as device noise r and an
  /// error of variance s^2 of which each range shares the part c with the last: r + s^2 (1 + c) / (1 - c).
  /// `facet_size_m`: how far apart the features are on the ground.
  double variance(const Vec3& impact_W_m, double facet_size_m, double noise_m, double relief_m) const {
    constexpr double kMostShared = 0.9999;  // of the error, when the beam stands still
    const double shared =
        last_W_m_ ? std::min(exact::exp(-(impact_W_m - *last_W_m_).norm() / facet_size_m), kMostShared) : 0.0;
    return noise_m * noise_m + relief_m * relief_m * (1.0 + shared) / (1.0 - shared);
  }

 private:
  std::optional<Vec3> last_W_m_;
};

}  // namespace plumb
