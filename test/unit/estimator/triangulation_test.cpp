#include "fsw/estimator/triangulation.h"

#include <gtest/gtest.h>

#include <limits>

#include "test/support/estimator_cases.h"

namespace plumb {
namespace {

using test::feature_of;

struct TrackCase {
  Vec3 point = Vec3::Zero();
  Views views;
  std::size_t anchor = 0;
};

/// A track of any length: cameras side by side that turn as they please and keep the point in view.
TrackCase any_track(test::Generator& g, double noise) {
  TrackCase c;
  const CameraPose first = test::camera_seeing(g, Vec3::Zero());
  const double depth = (first.R_WC.transpose() * -first.p_WC_m).z();
  const auto length = static_cast<std::size_t>(g.integer(2, kMaxTrackLength));
  const Vec3 step = first.R_WC * Vec3(g.uniform(0.05, 0.2), g.uniform(-0.1, 0.1), g.uniform(-0.05, 0.05)) * depth;
  for (std::size_t i = 0; i < length; ++i) {
    View view;
    view.camera.R_WC = first.R_WC * so3_exp(g.normal_vector<3>(0.03)).toRotationMatrix();
    const double along = static_cast<double>(i) / static_cast<double>(length - 1);
    view.camera.p_WC_m = first.p_WC_m + (along - 0.5) * step;
    view.z = feature_of(view.camera, c.point).head<2>() + g.normal_vector<2>(noise);
    EXPECT_EQ(c.views.push_back(view), Status::kOk);
  }
  c.anchor = static_cast<std::size_t>(g.integer(0, static_cast<std::int64_t>(length) - 1));
  return c;
}

TriangulationLimits any_noise() {
  TriangulationLimits limits;
  limits.max_rms = 1e9;
  limits.max_depth_m = 1e9;
  limits.min_depth_m = 1e-9;
  return limits;
}

double cost(const Views& views, std::size_t anchor, const FeatureParameters& feature) {
  double sum = 0.0;
  for (const View& view : views) {
    VisualPrediction p;
    EXPECT_EQ(predict_feature(view.camera, views[anchor].camera, feature, p), Status::kOk);
    sum += (view.z - p.z).squaredNorm();
  }
  return sum;
}

/// The least-squares inverse depth along the anchor's own ray, from the algebraic error: the two-view start of old.
double depth_along_the_ray(const TrackCase& c) {
  const View& a = c.views[c.anchor];
  double numerator = 0.0;
  double denominator = 0.0;
  for (const View& view : c.views) {
    const Vec3 z = view.z.homogeneous().normalized();
    const Vec3 moving = z.cross(view.camera.R_WC.transpose() * (a.camera.p_WC_m - view.camera.p_WC_m));
    numerator -= moving.dot(z.cross(view.camera.R_WC.transpose() * a.camera.R_WC * a.z.homogeneous()));
    denominator += moving.squaredNorm();
  }
  return numerator / denominator;
}

// Every length from two views to the longest there is, with the anchor anywhere in it (F6, F24).
TEST(Triangulation, RecoversWithoutNoise) {
  test::for_all(1000, [](test::Generator& g) {
    const TrackCase c = any_track(g, 0.0);
    TriangulationLimits limits = any_noise();
    limits.min_parallax = 0.002;
    if (parallax(c.views, c.anchor) < limits.min_parallax) return;
    const Result<FeatureParameters> found = triangulate(c.views, c.anchor, limits);
    ASSERT_TRUE(found.has_value());
    const FeatureParameters truth = feature_of(c.views[c.anchor].camera, c.point);
    EXPECT_LT((*found - truth).norm(), 1e-8 * truth.norm());
  });
}

TEST(Triangulation, IsTheLeastSquaresEstimate) {
  test::for_all(500, [](test::Generator& g) {
    const TrackCase c = any_track(g, 1e-3);
    const Result<FeatureParameters> found = triangulate(c.views, c.anchor, any_noise());
    if (!found) return;
    const double best = cost(c.views, c.anchor, *found);
    for (int k = 0; k < 6; ++k) {
      FeatureParameters aside = *found;
      aside(k % 3) += (k < 3 ? 1e-3 : -1e-3) * (k % 3 == 2 ? found->z() : 1.0);
      EXPECT_GE(cost(c.views, c.anchor, aside), best * (1.0 - 1e-9));
    }
  });
}

// A step is taken only when it lowers the cost: whatever the observations, the end is no worse than the start.
TEST(Triangulation, NeverEndsWorseThanItStarted) {
  test::for_all(1000, [](test::Generator& g) {
    const TrackCase c = any_track(g, g.uniform(0.001, 0.15));
    const Result<FeatureParameters> found = triangulate(c.views, c.anchor, any_noise());
    if (!found) return;
    const Vec2& z = c.views[c.anchor].z;
    const double start = cost(c.views, c.anchor, FeatureParameters(z.x(), z.y(), depth_along_the_ray(c)));
    EXPECT_LE(cost(c.views, c.anchor, *found), start * (1.0 + 1e-12));
  });
}

TEST(Triangulation, RefusesLowParallax) {
  test::for_all(500, [](test::Generator& g) {
    TrackCase c = any_track(g, 0.0);
    const TriangulationLimits limits;
    const Vec3 here = c.views[0].camera.p_WC_m;
    for (View& view : c.views) {  // turning on the spot: much flow in the image, no parallax
      view.camera.p_WC_m = here;
      view.z = feature_of(view.camera, c.point).head<2>();
    }
    EXPECT_LT(parallax(c.views, c.anchor), 1e-12);
    EXPECT_EQ(triangulate(c.views, c.anchor, limits).status(), Status::kIllConditioned);
  });
}

TEST(Triangulation, ParallaxIsFreeOfRotation) {
  test::for_all(300, [](test::Generator& g) {
    const TrackCase c = any_track(g, 0.0);
    TrackCase turned = c;
    for (View& view : turned.views) {
      if (&view == &turned.views[c.anchor]) continue;
      view.camera.R_WC = view.camera.R_WC * so3_exp(g.normal_vector<3>(0.05)).toRotationMatrix();
      view.z = feature_of(view.camera, c.point).head<2>();
    }
    EXPECT_NEAR(parallax(turned.views, c.anchor), parallax(c.views, c.anchor), 1e-10);
  });
}

// Rays that open up instead of meeting belong to a point behind the cameras.
TEST(Triangulation, RefusesWhatLiesBehind) {
  test::for_all(500, [](test::Generator& g) {
    TrackCase c = any_track(g, 0.0);
    // Mirrored through the point, each camera has it behind itself and in the same place of the image.
    for (View& view : c.views) view.camera.p_WC_m = 2.0 * c.point - view.camera.p_WC_m;
    const Result<FeatureParameters> found = triangulate(c.views, c.anchor, any_noise());
    EXPECT_FALSE(found.has_value());
  });
}

TEST(Triangulation, RefusesDepthsOutsideTheLimits) {
  test::for_all(300, [](test::Generator& g) {
    const TrackCase c = any_track(g, 0.0);
    const double depth = 1.0 / feature_of(c.views[c.anchor].camera, c.point).z();
    TriangulationLimits limits = any_noise();
    limits.max_depth_m = 0.9 * depth;
    EXPECT_FALSE(triangulate(c.views, c.anchor, limits).has_value());
    limits.max_depth_m = 1e9;
    limits.min_depth_m = 1.1 * depth;
    EXPECT_FALSE(triangulate(c.views, c.anchor, limits).has_value());
  });
}

TEST(Triangulation, RefusesAMismatch) {
  test::for_all(300, [](test::Generator& g) {
    TrackCase c = any_track(g, 0.0);
    if (c.views.size() < 4) return;
    TriangulationLimits limits;
    limits.max_rms = 0.003;
    const double angle = g.uniform(0.0, 6.28);
    c.views[c.views.size() / 2].z += 0.2 * Vec2(std::cos(angle), std::sin(angle));
    EXPECT_FALSE(triangulate(c.views, c.anchor, limits).has_value());
  });
}

TEST(Triangulation, RefusesWhatIsNotANumber) {
  test::for_all(200, [](test::Generator& g) {
    TrackCase c = any_track(g, 0.0);
    const auto bad = static_cast<std::size_t>(g.integer(0, static_cast<std::int64_t>(c.views.size()) - 1));
    c.views[bad].z.x() = std::numeric_limits<double>::quiet_NaN();
    EXPECT_FALSE(triangulate(c.views, c.anchor, any_noise()).has_value());
  });
}

TEST(TriangulationDeathTest, NeedsTwoViewsAndAnAnchorAmongThem) {
  test::for_all(1, [](test::Generator& g) {
    TrackCase c = any_track(g, 0.0);
    EXPECT_DEATH(static_cast<void>(triangulate(c.views, c.views.size(), any_noise())), "");
    Views one;
    EXPECT_EQ(one.push_back(c.views[0]), Status::kOk);
    EXPECT_DEATH(static_cast<void>(triangulate(one, 0, any_noise())), "");
  });
}

}  // namespace
}  // namespace plumb
