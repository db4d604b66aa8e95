// A track whose depth a range tells in one of its images: what the extra row says, and what it must not say.

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "fsw/estimator/chi_square.h"
#include "test/support/track_case.h"

namespace plumb {
namespace {

using test::Dense;
using test::dense;
using test::feature_of;
using test::index;
using test::moved;
using test::Vec6;

using test::kSigma;
using Rows = test::TrackCaseRows;

struct RangedCase : test::TrackCase {
  KnownDepth known;
};

/// Ranged in any of its views, and right but for `noise` (sigmas) in everything.
RangedCase any_case(test::Generator& g, double noise) {
  RangedCase c{test::any_track(g, noise * kSigma), {}};
  c.limits.min_parallax = 10.0;  // more than there ever is: a ranged track needs none
  c.known.view = static_cast<std::size_t>(g.integer(0, static_cast<int>(c.views.size()) - 1));
  const double rho = feature_of(c.views[c.known.view].camera, c.point).z();
  c.known.sigma_1_m = 0.01 * rho;
  c.known.rho_1_m = rho + noise * g.normal(c.known.sigma_1_m);
  c.known.weight = kSigma / c.known.sigma_1_m;
  return c;
}

/// Everything that is measured, whitened, as a function of the feature in the last view and of all poses' errors.
Eigen::VectorXd measured(const RangedCase& c, const FeatureParameters& feature, const Eigen::VectorXd& pose_errors) {
  Eigen::VectorXd out(index(2 * c.views.size() + 1));
  const auto pose = [&](std::size_t i) {
    return moved(c.views[i].camera, Vec6(pose_errors.segment<6>(index(6 * c.views[i].pose_slot))));
  };
  const CameraPose anchor = pose(c.views.size() - 1);
  const Vec3 point = feature_in_world(anchor, feature);
  for (std::size_t i = 0; i < c.views.size(); ++i)
    out.segment<2>(index(2 * i)) = feature_of(pose(i), point).head<2>() / kSigma;
  out(out.size() - 1) = feature_of(pose(c.known.view), point).z() / c.known.sigma_1_m;
  return out;
}

/// The same Jacobians by central differences: feature, then poses.
Dense numeric(const RangedCase& c, const FeatureParameters& feature) {
  constexpr double kStep = 1e-6;
  const auto columns = index(Rows::kColumns - 1);
  Dense out(index(2 * c.views.size() + 1), columns);
  for (Eigen::Index k = 0; k < columns; ++k) {
    Eigen::VectorXd e = Eigen::VectorXd::Zero(columns);
    e(k) = kStep;
    out.col(k) = (measured(c, feature + e.head<3>(), e.tail(columns - 3)) -
                  measured(c, feature - e.head<3>(), -e.tail(columns - 3))) /
                 (2.0 * kStep);
  }
  return out;
}

// Nothing is lost and nothing added: the rows have the normal equations of all observations and the range together.
TEST(RangedTrack, RowsAreThoseOfAllObservationsAndTheRange) {
  test::for_all(100, [](test::Generator& g) {
    const RangedCase c = any_case(g, 1.0);
    Rows rows;
    ASSERT_EQ(build_track_rows(c.views, c.limits, kSigma, rows, &c.known), Status::kOk);
    ASSERT_EQ(rows.rows, 2 * c.views.size() + 1);
    Dense full(index(rows.rows), index(Rows::kColumns));
    Eigen::VectorXd seen(index(rows.rows));
    for (std::size_t i = 0; i < c.views.size(); ++i) seen.segment<2>(index(2 * i)) = c.views[i].z / kSigma;
    seen(seen.size() - 1) = c.known.rho_1_m / c.known.sigma_1_m;
    const Eigen::VectorXd zero = Eigen::VectorXd::Zero(index(Rows::kPoseColumns));
    full << numeric(c, rows.feature), seen - measured(c, rows.feature, zero);
    const Dense after = dense(rows.work.view(rows.rows, Rows::kColumns));
    EXPECT_LT((test::gram(after) - test::gram(full)).norm(), 1e-6 * full.squaredNorm());
  });
}

/// What a common displacement of all poses, and a stretching of the window about its origin, do to the pose rows.
struct Directions {
  double common = 0.0;
  double stretch = 0.0;
};
Directions seen_by(Rows& rows, const RangedCase& c) {
  const Dense h = dense(rows.pose_rows()).leftCols(index(Rows::kPoseColumns));
  Dense common = Dense::Zero(h.cols(), 6);
  Eigen::VectorXd stretch = Eigen::VectorXd::Zero(h.cols());
  for (const View& view : c.views) {
    common.middleRows<6>(index(6 * view.pose_slot)).setIdentity();
    stretch.segment<3>(index(6 * view.pose_slot + 3)) = view.camera.p_WC_m;
  }
  return {(h * common).norm() / h.norm(), (h * stretch).norm() / (h.norm() * stretch.norm())};
}

// Position and heading stay unobservable; the scale of the window, which no camera sees, is what the range tells.
TEST(RangedTrack, SeesScaleButNoCommonDisplacement) {
  test::for_all(200, [](test::Generator& g) {
    RangedCase c = any_case(g, 0.0);
    Rows with;
    ASSERT_EQ(build_track_rows(c.views, c.limits, kSigma, with, &c.known), Status::kOk);
    const Directions ranged = seen_by(with, c);
    EXPECT_LT(ranged.common, 1e-9);
    EXPECT_GT(ranged.stretch, 1e-6);
    c.limits.min_parallax = 0.0;
    Rows without;
    ASSERT_EQ(build_track_rows(c.views, c.limits, kSigma, without), Status::kOk);
    EXPECT_LT(seen_by(without, c).stretch, 1e-3 * ranged.stretch);
  });
}

TEST(RangedTrack, IsTriangulatedWithoutParallax) {
  test::for_all(200, [](test::Generator& g) {
    RangedCase c = any_case(g, 0.0);
    for (View& view : c.views) {  // turning in place
      view.camera.p_WC_m = c.views[0].camera.p_WC_m;
      view.z = feature_of(view.camera, c.point).head<2>();
    }
    c.known.rho_1_m = feature_of(c.views[c.known.view].camera, c.point).z();
    const std::size_t anchor = c.views.size() - 1;
    EXPECT_EQ(triangulate(c.views, anchor, c.limits).status(), Status::kIllConditioned);
    const Result<FeatureParameters> found = triangulate(c.views, anchor, c.limits, &c.known);
    ASSERT_TRUE(found.has_value());
    EXPECT_LT((feature_in_world(c.views[anchor].camera, *found) - c.point).norm(), 1e-6);
  });
}

// A track that a range contradicts is gated, and the bound is that of one more row: twice the length less two.
TEST(RangedTrack, ARangeThatContradictsTheTrackIsGated) {
  const ChiSquareTable gate(0.95);
  int refused = 0;
  test::for_all(100, [&](test::Generator& g) {
    RangedCase c = any_case(g, 0.0);
    static MatrixStorage<Rows::kPoseColumns, Rows::kPoseColumns> poses;
    test::store(Dense::Identity(index(Rows::kPoseColumns), index(Rows::kPoseColumns)) * 1e-8, poses.view());
    Rows rows;
    ASSERT_EQ(build_track_rows(c.views, c.limits, kSigma, rows, &c.known), Status::kOk);
    ASSERT_EQ(rows.pose_rows().rows(), 2 * c.views.size() - 2);
    EXPECT_LE(innovation_squared(rows, poses.view()), gate.quantile(rows.pose_rows().rows()));
    c.known.rho_1_m *= 2.0;
    c.limits.max_rms = 1e3;
    const bool passed = ok(build_track_rows(c.views, c.limits, kSigma, rows, &c.known)) &&
                        innovation_squared(rows, poses.view()) <= gate.quantile(rows.pose_rows().rows());
    refused += passed ? 0 : 1;
  });
  EXPECT_EQ(refused, 100);
}

}  // namespace
}  // namespace plumb
