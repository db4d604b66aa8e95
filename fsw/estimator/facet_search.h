#pragma once
// The facet of the Delaunay triangulation of image points that contains a query point (paper section III-C2).

#include <array>
#include <cstddef>
#include <span>

#include "fsw/base/status.h"
#include "fsw/math/so3.h"

namespace plumb {

struct FacetChoice {
  std::array<std::size_t, 3> vertices{};  ///< indices into the points, increasing
};

/// The Delaunay triangle under `query`. Lifted to the paraboloid z = |x|^2, the Delaunay triangulation is the lower
/// convex hull, and the triangle over a point is the one whose lifted plane is lowest there: a linear programme with
/// three basic points, solved by pivoting from an artificial triangle around everything. Exactly the triangle that a
/// full triangulation would give, in a few passes over the points.
/// kNotReady: the query lies outside the convex hull, or there are fewer than three points.
Result<FacetChoice> find_facet(std::span<const Vec2> points, const Vec2& query);

/// Takes a homogeneous image point to its weights on the facet's vertices: what is affine over the image has there the
/// weighted sum of its values at the vertices.
Mat3 barycentric(std::span<const Vec2> points, const FacetChoice& facet);

}  // namespace plumb
