// Every Jacobian of the measurement models against central differences of the true retraction, and the laws that hold
// whatever the numbers: what a sensor cannot see, it must not claim to see.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "fsw/estimator/range_model.h"
#include "fsw/estimator/visual_model.h"
#include "test/support/estimator_cases.h"

namespace plumb {
namespace {

using test::feature_of;
using test::moved;
using test::numeric_jacobian;
using test::Vec6;

constexpr double kStep = 1e-6;
constexpr double kTolerance = 2e-7;  // relative: what central differences of kStep leave

double relative(double error, double size) { return error / std::max(1.0, size); }

struct VisualCase {
  Vec3 point = Vec3::Zero();
  CameraPose camera, anchor;
  FeatureParameters feature;
};

VisualCase any_visual_case(test::Generator& g) {
  VisualCase c;
  c.point = g.normal_vector<3>(5.0);
  c.camera = test::camera_seeing(g, c.point);
  c.anchor = test::camera_seeing(g, c.point);
  c.feature = feature_of(c.anchor, c.point);
  return c;
}

VisualPrediction predicted(const CameraPose& camera, const CameraPose& anchor, const FeatureParameters& feature) {
  VisualPrediction p;
  EXPECT_EQ(predict_feature(camera, anchor, feature, p), Status::kOk);
  return p;
}

TEST(VisualJacobian, OfObserverAnchorAndFeature) {
  test::for_all(500, [](test::Generator& g) {
    const VisualCase c = any_visual_case(g);
    const VisualPrediction p = predicted(c.camera, c.anchor, c.feature);
    EXPECT_LT((p.z - feature_of(c.camera, c.point).head<2>()).norm(), 1e-11);
    const auto by_camera = numeric_jacobian<2, 6>(
        [&](const Vec6& e) { return predicted(moved(c.camera, e), c.anchor, c.feature).z; }, kStep);
    const auto by_anchor = numeric_jacobian<2, 6>(
        [&](const Vec6& e) { return predicted(c.camera, moved(c.anchor, e), c.feature).z; }, kStep);
    const auto by_feature =
        numeric_jacobian<2, 3>([&](const Vec3& e) { return predicted(c.camera, c.anchor, c.feature + e).z; }, kStep);
    EXPECT_LT(relative((p.by_pose - by_camera).norm(), by_camera.norm()), kTolerance);
    EXPECT_LT(relative((p.by_pose + by_anchor).norm(), by_anchor.norm()), kTolerance);
    EXPECT_LT(relative((p.by_feature - by_feature).norm(), by_feature.norm()), kTolerance * 10.0);
  });
}

TEST(VisualJacobian, InItsOwnAnchorAFeatureIsItsParameters) {
  test::for_all(200, [](test::Generator& g) {
    const VisualCase c = any_visual_case(g);
    const VisualPrediction p = predicted(c.anchor, c.anchor, c.feature);
    EXPECT_LT((p.z - c.feature.head<2>()).norm(), 1e-14);
    EXPECT_LT((p.by_feature - Mat23::Identity()).norm(), 1e-14);
    // Observer and anchor are the same pose: moving it moves nothing.
    const auto together = numeric_jacobian<2, 6>(
        [&](const Vec6& e) { return predicted(moved(c.anchor, e), moved(c.anchor, e), c.feature).z; }, kStep);
    EXPECT_LT(together.norm(), 1e-8);
  });
}

TEST(VisualJacobian, HoldsAtInfinity) {
  test::for_all(200, [](test::Generator& g) {
    VisualCase c = any_visual_case(g);
    c.camera.R_WC = moved(c.anchor, (Vec6() << g.normal_vector<3>(0.1), Vec3::Zero()).finished()).R_WC;
    c.feature.z() = 0.0;
    const VisualPrediction p = predicted(c.camera, c.anchor, c.feature);
    const auto by_camera = numeric_jacobian<2, 6>(
        [&](const Vec6& e) { return predicted(moved(c.camera, e), c.anchor, c.feature).z; }, kStep);
    EXPECT_LT(relative((p.by_pose - by_camera).norm(), by_camera.norm()), kTolerance);
    EXPECT_EQ(p.by_pose.rightCols<3>().norm(), 0.0);  // infinitely far: no position is seen
  });
}

// Moving the whole world, cameras and all, shows nothing. With the feature fixed to its anchor this is a common
// (theta, xi_p) of all poses, of any size: no heading, no position, and not even tilt comes from a camera.
TEST(VisualJacobian, ACommonDisplacementIsInvisible) {
  test::for_all(200, [](test::Generator& g) {
    const VisualCase c = any_visual_case(g);
    const Vec6 e = g.normal_vector<6>(1.0);
    const Vec2 before = predicted(c.camera, c.anchor, c.feature).z;
    EXPECT_LT((predicted(moved(c.camera, e), moved(c.anchor, e), c.feature).z - before).norm(), 1e-11);
  });
}

TEST(VisualModel, RefusesWhatIsBehind) {
  test::for_all(200, [](test::Generator& g) {
    const VisualCase c = any_visual_case(g);
    VisualPrediction p;
    Reanchoring r;
    FeatureParameters negative = c.feature;
    negative.z() = -g.uniform(1e-3, 2.0);
    EXPECT_EQ(reanchor_feature(c.anchor, c.camera, negative, r), Status::kInvalidValue);
    negative.z() = 0.0;
    EXPECT_EQ(reanchor_feature(c.anchor, c.camera, negative, r), Status::kInvalidValue);
    CameraPose turned = c.camera;  // half a turn about its x axis: it looks away
    turned.R_WC = turned.R_WC * Vec3(1.0, -1.0, -1.0).asDiagonal();
    EXPECT_EQ(predict_feature(turned, c.anchor, c.feature, p), Status::kInvalidValue);
    EXPECT_EQ(reanchor_feature(c.anchor, turned, c.feature, r), Status::kInvalidValue);
    const FeatureParameters poison(NAN, c.feature.y(), c.feature.z());
    EXPECT_EQ(predict_feature(c.camera, c.anchor, poison, p), Status::kInvalidValue);
  });
}

Reanchoring reanchored(const CameraPose& from, const CameraPose& to, const FeatureParameters& feature) {
  Reanchoring r;
  EXPECT_EQ(reanchor_feature(from, to, feature, r), Status::kOk);
  return r;
}

TEST(ReanchorJacobian, OfBothAnchorsAndTheOldParameters) {
  test::for_all(500, [](test::Generator& g) {
    const VisualCase c = any_visual_case(g);
    const Reanchoring r = reanchored(c.anchor, c.camera, c.feature);
    EXPECT_LT((feature_in_world(c.camera, r.feature) - c.point).norm(), 1e-10);
    const auto by_from = numeric_jacobian<3, 6>(
        [&](const Vec6& e) { return reanchored(moved(c.anchor, e), c.camera, c.feature).feature; }, kStep);
    const auto by_to = numeric_jacobian<3, 6>(
        [&](const Vec6& e) { return reanchored(c.anchor, moved(c.camera, e), c.feature).feature; }, kStep);
    constexpr double kSmallStep = 1e-7;  // the depth is far from linear in rho
    const auto by_feature = numeric_jacobian<3, 3>(
        [&](const Vec3& e) { return reanchored(c.anchor, c.camera, c.feature + e).feature; }, kSmallStep);
    EXPECT_LT(relative((r.by_from - by_from).norm(), by_from.norm()), 1e-6);
    EXPECT_LT(relative((r.by_to - by_to).norm(), by_to.norm()), 1e-6);
    EXPECT_LT(relative((r.by_feature - by_feature).norm(), by_feature.norm()), 1e-5);
  });
}

TEST(ReanchorJacobian, ThereAndBackIsNothing) {
  test::for_all(200, [](test::Generator& g) {
    const VisualCase c = any_visual_case(g);
    const Reanchoring there = reanchored(c.anchor, c.camera, c.feature);
    const Reanchoring back = reanchored(c.camera, c.anchor, there.feature);
    EXPECT_LT((back.feature - c.feature).norm(), 1e-10);
    EXPECT_LT((back.by_feature * there.by_feature - Mat3::Identity()).norm(), 1e-8);
    EXPECT_LT((back.by_feature * there.by_from + back.by_to).norm(), 1e-7 * (1.0 + back.by_to.norm()));
  });
}

struct RangeCase {
  CameraPose camera;
  Beam beam;
  Facet facet;
  std::array<Vec3, 3> points{};
};

/// A beam that meets a facet, inside or outside of its triangle, at no less than 15 degrees to its plane.
RangeCase any_range_case(test::Generator& g) {
  RangeCase c;
  c.camera = {test::any_attitude(g).toRotationMatrix(), g.normal_vector<3>(5.0)};
  c.beam.p_CR_m = g.normal_vector<3>(0.1);
  c.beam.u_C = Vec3(g.uniform(-0.4, 0.4), g.uniform(-0.4, 0.4), 1.0).normalized();
  const Vec3 u = c.camera.R_WC * c.beam.u_C;
  const Vec3 impact = c.camera.p_WC_m + c.camera.R_WC * c.beam.p_CR_m + g.uniform(2.0, 20.0) * u;
  Vec3 normal = g.direction();
  while (std::abs(normal.dot(u)) < 0.26) normal = g.direction();
  const Vec3 e1 = normal.unitOrthogonal();
  const Vec3 e2 = normal.cross(e1);
  double area = 0.0;
  while (area < 0.1) {  // no slivers: their range is too far from linear for differences
    const double first = g.uniform(0.0, 6.28);
    for (std::size_t j = 0; j < 3; ++j) {
      const double angle = first + 2.1 * static_cast<double>(j) + g.uniform(-0.4, 0.4);
      c.points[j] = impact + g.uniform(0.2, 1.5) * (std::cos(angle) * e1 + std::sin(angle) * e2);
      if (g.integer(0, 3) == 0) c.points[j] += 0.5 * e1;
    }
    area = (c.points[0] - c.points[1]).cross(c.points[2] - c.points[1]).norm();
  }
  for (std::size_t j = 0; j < 3; ++j) {
    const CameraPose anchor = test::camera_seeing(g, c.points[j]);
    c.facet[j] = {anchor, feature_of(anchor, c.points[j])};
  }
  return c;
}

RangePrediction predicted(const CameraPose& camera, const Beam& beam, const Facet& facet) {
  RangePrediction p;
  EXPECT_EQ(predict_range(camera, beam, facet, p), Status::kOk);
  return p;
}

using Scalar = Eigen::Matrix<double, 1, 1>;
Scalar range_of(const CameraPose& camera, const Beam& beam, const Facet& facet) {
  return Scalar(predicted(camera, beam, facet).range_m);
}

TEST(RangeJacobian, OfCameraAnchorsAndFeatures) {
  test::for_all(500, [](test::Generator& g) {
    const RangeCase c = any_range_case(g);
    const RangePrediction p = predicted(c.camera, c.beam, c.facet);
    const auto by_camera =
        numeric_jacobian<1, 6>([&](const Vec6& e) { return range_of(moved(c.camera, e), c.beam, c.facet); }, kStep);
    EXPECT_LT(relative((p.by_camera - by_camera).norm(), by_camera.norm()), kTolerance * 50.0);
    for (std::size_t j = 0; j < 3; ++j) {
      const auto with = [&](const Vec6& e, const Vec3& f) {
        Facet facet = c.facet;
        facet[j] = {moved(facet[j].anchor, e), facet[j].feature + f};
        return range_of(c.camera, c.beam, facet);
      };
      const auto by_anchor = numeric_jacobian<1, 6>([&](const Vec6& e) { return with(e, Vec3::Zero()); }, kStep);
      const auto by_feature = numeric_jacobian<1, 3>([&](const Vec3& f) { return with(Vec6::Zero(), f); }, 0.1 * kStep);
      EXPECT_LT(relative((p.by_anchor[j] - by_anchor).norm(), by_anchor.norm()), kTolerance * 50.0);
      EXPECT_LT(relative((p.by_feature[j] - by_feature).norm(), by_feature.norm()), kTolerance * 50.0);
    }
  });
}

// Anchors may be one pose, and that pose may be the camera's own: then the contributions add up.
TEST(RangeJacobian, CoincidentPosesAddUp) {
  test::for_all(200, [](test::Generator& g) {
    const RangeCase c = any_range_case(g);
    const RangePrediction p = predicted(c.camera, c.beam, c.facet);
    const auto all = numeric_jacobian<1, 6>(
        [&](const Vec6& e) {
          Facet facet = c.facet;
          facet[0].anchor = moved(facet[0].anchor, e);
          facet[1].anchor = moved(facet[1].anchor, e);
          return range_of(moved(c.camera, e), c.beam, facet);
        },
        kStep);
    const Row6 sum = p.by_camera + p.by_anchor[0] + p.by_anchor[1];
    EXPECT_LT(relative((sum - all).norm(), all.norm()), kTolerance * 50.0);
  });
}

TEST(RangeJacobian, TheRowIsBarycentric) {
  test::for_all(500, [](test::Generator& g) {
    const RangeCase c = any_range_case(g);
    const RangePrediction p = predicted(c.camera, c.beam, c.facet);
    const Vec3 origin = c.camera.p_WC_m + c.camera.R_WC * c.beam.p_CR_m;
    const Vec3 impact = origin + p.range_m * (c.camera.R_WC * c.beam.u_C);
    EXPECT_NEAR(p.lambda.sum(), 1.0, 1e-12);
    const Vec3 rebuilt = p.lambda(0) * c.points[0] + p.lambda(1) * c.points[1] + p.lambda(2) * c.points[2];
    EXPECT_LT((rebuilt - impact).norm(), 1e-9);
    // Position columns: minus the camera's, shared out among the vertices; so they sum to zero.
    double scale = 0.0;
    Row6 sum = p.by_camera;
    for (std::size_t j = 0; j < 3; ++j) {
      const Eigen::RowVector3d by_point = p.by_anchor[j].tail<3>();
      EXPECT_LT((by_point + p.lambda(static_cast<Eigen::Index>(j)) * p.by_camera.tail<3>()).norm(), 1e-12);
      sum += p.by_anchor[j];
      scale += by_point * (c.points[j] - origin);
    }
    // Translation and turn of everything together change no range: H N = 0.
    EXPECT_LT(sum.norm(), 1e-10 * (1.0 + p.by_camera.norm()));
    // Stretch the scene about the range finder, and the range stretches with it: the row observes scale.
    EXPECT_NEAR(scale, p.range_m, 1e-9 * p.range_m);
  });
}

// One feature stands for the plane through it across the beam: the row is that of a facet in this plane, but that all
// of it hangs on the one feature.
TEST(RangeModel, OneFeatureIsAFacetAcrossTheBeam) {
  test::for_all(300, [](test::Generator& g) {
    RangeCase c = any_range_case(g);
    const Vec3 u = c.camera.R_WC * c.beam.u_C;
    const Vec3 origin = c.camera.p_WC_m + c.camera.R_WC * c.beam.p_CR_m;
    const Vec3 e1 = u.unitOrthogonal();
    const double range_m = g.uniform(2.0, 20.0);
    const Vec3 off = g.uniform(0.0, 0.5) * e1;
    c.points = {origin + range_m * u + off, origin + range_m * u + e1, origin + range_m * u + u.cross(e1)};
    for (std::size_t j = 0; j < 3; ++j) {
      const CameraPose anchor = test::camera_seeing(g, c.points[j]);
      c.facet[j] = {anchor, feature_of(anchor, c.points[j])};
    }
    const RangePrediction facet = predicted(c.camera, c.beam, c.facet);
    RangePrediction one;
    ASSERT_EQ(predict_range(c.camera, c.beam, {c.facet.data(), 1}, one), Status::kOk);
    EXPECT_NEAR(one.range_m, range_m, 1e-9);
    EXPECT_NEAR(one.range_m, facet.range_m, 1e-9);
    EXPECT_NEAR(one.cos_incidence, 1.0, 1e-12);
    EXPECT_LT((one.by_camera - facet.by_camera).norm(), 1e-8 * (1.0 + one.by_camera.norm()));
    EXPECT_LT((one.by_origin - facet.by_origin).norm(), 1e-9);
    EXPECT_LT((one.by_direction - facet.by_direction).norm(), 1e-7);
    Row6 anchors = Row6::Zero();
    for (const Row6& by_anchor : facet.by_anchor) anchors += by_anchor;
    // Moved along the beam, all three vertices do what the one does.
    EXPECT_LT((one.by_anchor[0].tail<3>() - anchors.tail<3>()).norm(), 1e-9);
    const auto by_feature = numeric_jacobian<1, 3>(
        [&](const Vec3& f) {
          const FacetVertex moved_to{c.facet[0].anchor, c.facet[0].feature + f};
          RangePrediction there;
          EXPECT_EQ(predict_range(c.camera, c.beam, {&moved_to, 1}, there), Status::kOk);
          return Scalar(there.range_m);
        },
        0.1 * kStep);
    EXPECT_LT(relative((one.by_feature[0] - by_feature).norm(), by_feature.norm()), kTolerance * 50.0);
  });
}

TEST(RangeModel, DoesNotDependOnTheOrderOfTheVertices) {
  test::for_all(200, [](test::Generator& g) {
    const RangeCase c = any_range_case(g);
    const RangePrediction p = predicted(c.camera, c.beam, c.facet);
    const std::array<std::size_t, 3> order = {2, 0, 1};
    const RangePrediction q = predicted(c.camera, c.beam, {c.facet[2], c.facet[0], c.facet[1]});
    EXPECT_NEAR(p.range_m, q.range_m, 1e-10);
    for (std::size_t j = 0; j < 3; ++j) {
      EXPECT_LT((p.by_anchor[order[j]] - q.by_anchor[j]).norm(), 1e-9 * (1.0 + p.by_camera.norm()));
      EXPECT_NEAR(p.lambda(static_cast<Eigen::Index>(order[j])), q.lambda(static_cast<Eigen::Index>(j)), 1e-10);
    }
  });
}

TEST(RangeModel, RefusesDegenerateFacets) {
  test::for_all(200, [](test::Generator& g) {
    const RangeCase c = any_range_case(g);
    RangePrediction p;
    RangeCase in_line = c;
    const Vec3 third = c.points[0] + 2.0 * (c.points[1] - c.points[0]);
    in_line.facet[2].anchor = test::camera_seeing(g, third);
    in_line.facet[2].feature = feature_of(in_line.facet[2].anchor, third);
    EXPECT_EQ(predict_range(c.camera, c.beam, in_line.facet, p), Status::kIllConditioned);
    EXPECT_EQ(predict_range(c.camera, c.beam, Facet{c.facet[0], c.facet[0], c.facet[1]}, p), Status::kIllConditioned);

    Beam grazing = c.beam;
    const Vec3 along = c.camera.R_WC.transpose() * (c.points[1] - c.points[0]).normalized();
    grazing.u_C = along;
    EXPECT_EQ(predict_range(c.camera, grazing, c.facet, p), Status::kIllConditioned);
    Beam away = c.beam;
    away.u_C = -c.beam.u_C;
    EXPECT_EQ(predict_range(c.camera, away, c.facet, p), Status::kInvalidValue);
    for (const double rho : {0.0, -0.5, static_cast<double>(NAN)}) {
      Facet behind = c.facet;
      behind[1].feature.z() = rho;
      EXPECT_EQ(predict_range(c.camera, c.beam, behind, p), Status::kInvalidValue);
    }
  });
}

}  // namespace
}  // namespace plumb
