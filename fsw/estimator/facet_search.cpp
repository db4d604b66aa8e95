#include "fsw/estimator/facet_search.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace plumb {
namespace {

constexpr int kMaxPivots = 64;           // a pivot never revisits a triangle; far fewer are needed for 50 points
constexpr double kArtificialCost = 1e9;  // lifted height of the artificial vertices: any real triangle is lower
constexpr double kTolerance = 1e-12;

struct BasicPoint {
  Vec2 x = Vec2::Zero();
  double cost = 0.0;
  std::size_t index = 0;
  bool artificial = true;
};
using Triangle = std::array<BasicPoint, 3>;

/// Columns (x, y, 1) of the three basic points.
Mat3 basis_of(const Triangle& t) {
  Mat3 m;
  for (int j = 0; j < 3; ++j) m.col(j) << t[static_cast<std::size_t>(j)].x, 1.0;
  return m;
}

Triangle artificial_triangle(const Vec2& query, double reach) {
  const double r = 10.0 * reach;
  Triangle t;
  t[0].x = query + Vec2(0.0, r);
  t[1].x = query + Vec2(-r, -r);
  t[2].x = query + Vec2(r, -r);
  for (BasicPoint& p : t) p.cost = kArtificialCost * r * r;
  return t;
}

}  // namespace

Result<FacetChoice> find_facet(std::span<const Vec2> points, const Vec2& query) {
  if (points.size() < 3) return Status::kNotReady;
  double reach = 0.0;
  for (const Vec2& p : points) reach = std::max(reach, (p - query).norm());
  if (!(reach > 0.0)) return Status::kNotReady;
  Triangle t = artificial_triangle(query, reach);
  for (int pivot = 0; pivot < kMaxPivots; ++pivot) {
    const Mat3 inverse = basis_of(t).inverse();
    const Eigen::RowVector3d cost(t[0].cost, t[1].cost, t[2].cost);
    const Eigen::RowVector3d plane = cost * inverse;  // the lifted plane through the triangle
    // The point deepest below the plane enters (ties: the lowest index).
    std::size_t entering = points.size();
    double deepest = 0.0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Vec2 d = points[i] - query;
      const double below = d.squaredNorm() - plane.dot(points[i].homogeneous());
      if (below < deepest - kTolerance * reach * reach) {
        deepest = below;
        entering = i;
      }
    }
    if (entering == points.size()) break;
    // The vertex that the query's barycentric coordinates run out of first leaves.
    const Vec3 lambda = inverse * query.homogeneous();
    const Vec3 rate = inverse * points[entering].homogeneous();
    int leaving = -1;
    double step = 0.0;
    for (int j = 0; j < 3; ++j) {
      if (rate(j) <= kTolerance) continue;
      const double ratio = lambda(j) / rate(j);
      if (leaving < 0 || ratio < step) {
        leaving = j;
        step = ratio;
      }
    }
    if (leaving < 0) return Status::kNotReady;
    t[static_cast<std::size_t>(leaving)] = {points[entering], (points[entering] - query).squaredNorm(), entering,
                                            false};
  }
  FacetChoice choice;
  for (std::size_t j = 0; j < 3; ++j) {
    if (t[j].artificial) return Status::kNotReady;
    choice.vertices[j] = t[j].index;
  }
  std::sort(choice.vertices.begin(), choice.vertices.end());
  return choice;
}

Mat3 barycentric(std::span<const Vec2> points, const FacetChoice& facet) {
  Mat3 corners;
  for (std::size_t j = 0; j < 3; ++j)
    corners.col(static_cast<Eigen::Index>(j)) = points[facet.vertices[j]].homogeneous();
  return corners.inverse();
}

}  // namespace plumb
