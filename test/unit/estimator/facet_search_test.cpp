// The facet under the beam against brute force: of all triangles over the query, one with an empty circumcircle.

#include "fsw/estimator/facet_search.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <vector>

#include "test/support/property.h"

namespace plumb {
namespace {

using Points = std::vector<Vec2>;

double reach_of(const Points& points, const Vec2& query) {
  double reach = 0.0;
  for (const Vec2& p : points) reach = std::max(reach, (p - query).norm());
  return reach;
}

double twice_area(const Vec2& a, const Vec2& b, const Vec2& c) {
  const Vec2 u = b - a;
  const Vec2 v = c - a;
  return u.x() * v.y() - u.y() * v.x();
}

Vec3 barycentric(const Vec2& a, const Vec2& b, const Vec2& c, const Vec2& q) {
  return Vec3(twice_area(q, b, c), twice_area(a, q, c), twice_area(a, b, q)) / twice_area(a, b, c);
}

/// The least power of a point with respect to the circle through a, b, c: negative when one lies inside it.
double emptiness(const Points& points, const Vec2& a, const Vec2& b, const Vec2& c) {
  Mat2 m;
  m << (b - a).transpose(), (c - a).transpose();
  const Vec2 centre = m.inverse() * (0.5 * Vec2((b - a).squaredNorm(), (c - a).squaredNorm()));
  double least = 0.0;
  for (const Vec2& p : points) least = std::min(least, (p - a - centre).squaredNorm() - centre.squaredNorm());
  return least;
}

/// Largest, over all triangles, of the least barycentric coordinate of the query: how deep it lies inside the hull.
double depth_inside(const Points& points, const Vec2& q, double least_area) {
  double deepest = -1e9;
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      for (std::size_t k = 0; k < j; ++k) {
        if (std::abs(twice_area(points[i], points[j], points[k])) < least_area) continue;
        deepest = std::max(deepest, barycentric(points[i], points[j], points[k], q).minCoeff());
      }
    }
  }
  return deepest;
}

/// The answer must be a proper triangle over the query with nothing inside its circumcircle; there must be one when the
/// query lies well inside the hull, and none when it lies well outside.
void expect_right(const Points& points, const Vec2& query) {
  const double reach = reach_of(points, query);
  const Result<FacetChoice> found = find_facet(points, query);
  constexpr double kMargin = 1e-6;
  const double inside = depth_inside(points, query, 1e-5 * reach * reach);
  if (inside > kMargin) {
    ASSERT_TRUE(found.has_value()) << "inside by " << inside;
  }
  if (!found) {
    EXPECT_EQ(found.status(), Status::kNotReady);
    return;
  }
  EXPECT_GT(inside, -kMargin);
  const auto [i, j, k] = found->vertices;
  ASSERT_LT(i, j);
  ASSERT_LT(j, k);
  ASSERT_LT(k, points.size());
  const double area = twice_area(points[i], points[j], points[k]);
  ASSERT_GT(std::abs(area), 1e-11 * reach * reach);
  if (std::abs(area) < 1e-5 * reach * reach) return;  // a sliver: its circle is not known to double precision
  EXPECT_GT(barycentric(points[i], points[j], points[k], query).minCoeff(), -kMargin);
  EXPECT_GT(emptiness(points, points[i], points[j], points[k]), -1e-7 * reach * reach);
}

Points random_points(test::Generator& g, std::size_t count, double scale) {
  Points points;
  for (std::size_t i = 0; i < count; ++i) points.push_back(scale * Vec2(g.uniform(-0.8, 0.8), g.uniform(-0.6, 0.6)));
  return points;
}

Vec2 any_query(test::Generator& g, double scale) { return scale * Vec2(g.uniform(-0.9, 0.9), g.uniform(-0.7, 0.7)); }

TEST(FacetSearch, IsDelaunayOverRandomPoints) {
  test::for_all(3000, [](test::Generator& g) {
    const double scale = g.integer(0, 3) == 0 ? 400.0 : 1.0;
    expect_right(random_points(g, static_cast<std::size_t>(g.integer(3, 28)), scale), any_query(g, scale));
  });
}

TEST(FacetSearch, IsDelaunayOverAFullState) {
  test::for_all(60, [](test::Generator& g) { expect_right(random_points(g, 50, 1.0), any_query(g, 1.0)); });
}

TEST(FacetSearch, SurvivesDuplicates) {
  test::for_all(1000, [](test::Generator& g) {
    Points points = random_points(g, static_cast<std::size_t>(g.integer(4, 15)), 1.0);
    for (int k = 0; k < 4; ++k) points.push_back(points[static_cast<std::size_t>(g.integer(0, 3))]);
    expect_right(points, any_query(g, 1.0));
  });
}

TEST(FacetSearch, TakesAnyTriangleOfACocircularGrid) {
  test::for_all(500, [](test::Generator& g) {
    Points points;
    const std::int64_t columns = g.integer(2, 6);
    const std::int64_t rows = g.integer(2, 5);
    for (std::int64_t c = 0; c < columns; ++c) {
      for (std::int64_t r = 0; r < rows; ++r)
        points.emplace_back(0.2 * static_cast<double>(c), 0.2 * static_cast<double>(r));
    }
    Vec2 query(g.uniform(-0.05, 1.05), g.uniform(-0.05, 0.85));
    if (g.integer(0, 3) == 0) query.x() = 0.2;  // on the edges of the grid
    expect_right(points, query);
  });
}

TEST(FacetSearch, HandlesQueriesOnVerticesAndEdges) {
  test::for_all(1000, [](test::Generator& g) {
    const Points points = random_points(g, static_cast<std::size_t>(g.integer(3, 20)), 1.0);
    const Vec2& a = points[static_cast<std::size_t>(g.integer(0, 1))];
    const Vec2& b = points[2];
    expect_right(points, a + g.uniform(0.0, 1.0) * (b - a));
    const Result<FacetChoice> found = find_facet(points, b);
    if (found) {
      EXPECT_GT(
          barycentric(points[found->vertices[0]], points[found->vertices[1]], points[found->vertices[2]], b).minCoeff(),
          -1e-6);
    }
  });
}

TEST(FacetSearch, FindsNothingInCollinearPoints) {
  test::for_all(500, [](test::Generator& g) {
    const Vec2 origin = any_query(g, 1.0);
    const Vec2 along = any_query(g, 1.0);
    Points points;
    for (int i = 0; i < 10; ++i) points.push_back(origin + g.uniform(-1.0, 1.0) * along);
    EXPECT_FALSE(find_facet(points, any_query(g, 1.0)).has_value());
  });
}

TEST(FacetSearch, MixesCollinearAndGeneralPoints) {
  test::for_all(500, [](test::Generator& g) {
    Points points = random_points(g, 4, 1.0);
    for (int i = 0; i < 8; ++i) points.push_back(points[0] + g.uniform(-1.0, 1.0) * (points[1] - points[0]));
    expect_right(points, any_query(g, 1.0));
  });
}

TEST(FacetSearch, FindsNothingOutsideTheHull) {
  test::for_all(500, [](test::Generator& g) {
    const Points points = random_points(g, 20, 1.0);
    const double angle = g.uniform(0.0, 6.28);
    EXPECT_EQ(find_facet(points, g.uniform(1.1, 50.0) * Vec2(std::cos(angle), std::sin(angle))).status(),
              Status::kNotReady);
  });
}

TEST(FacetSearch, NeedsThreePoints) {
  EXPECT_EQ(find_facet({}, Vec2::Zero()).status(), Status::kNotReady);
  const Points two = {Vec2(-1.0, 0.0), Vec2(1.0, 0.0)};
  EXPECT_EQ(find_facet(two, Vec2::Zero()).status(), Status::kNotReady);
  const Points same(3, Vec2(0.5, 0.5));
  EXPECT_EQ(find_facet(same, Vec2(0.5, 0.5)).status(), Status::kNotReady);
}

}  // namespace
}  // namespace plumb
