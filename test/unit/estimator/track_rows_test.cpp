#include "fsw/estimator/track_rows.h"

#include <gtest/gtest.h>

#include <memory>

#include "test/support/track_case.h"

namespace plumb {
namespace {

using test::Dense;
using test::dense;
using test::index;

using test::any_track;
using test::kSigma;
using test::TrackCase;
using Rows = test::TrackCaseRows;

/// The same rows before anything is taken out of them: feature, poses, residual; whitened.
struct FullRows {
  Dense by_feature;
  Dense poses_and_residual;
};
FullRows full_rows(const TrackCase& c, const FeatureParameters& feature) {
  const std::size_t anchor = c.views.size() - 1;
  FullRows out;
  out.by_feature = Dense::Zero(index(2 * c.views.size()), 3);
  out.poses_and_residual = Dense::Zero(index(2 * c.views.size()), index(Rows::kPoseColumns + 1));
  for (std::size_t i = 0; i < c.views.size(); ++i) {
    VisualPrediction p;
    EXPECT_EQ(predict_feature(c.views[i].camera, c.views[anchor].camera, feature, p), Status::kOk);
    const Eigen::Index row = index(2 * i);
    out.by_feature.middleRows<2>(row) = p.by_feature / kSigma;
    out.poses_and_residual.block<2, 6>(row, index(6 * c.views[i].pose_slot)) += p.by_pose / kSigma;
    out.poses_and_residual.block<2, 6>(row, index(6 * c.views[anchor].pose_slot)) -= p.by_pose / kSigma;
    out.poses_and_residual.block<2, 1>(row, index(Rows::kPoseColumns)) = (c.views[i].z - p.z) / kSigma;
  }
  return out;
}

// The projector onto everything that the feature cannot explain. What the pose rows say is exactly what it leaves: a
// shift of the residual by any H_f a is invisible to them.
TEST(TrackRows, PoseRowsAreBlindToTheFeature) {
  test::for_all(200, [](test::Generator& g) {
    const TrackCase c = any_track(g, kSigma);
    Rows rows;
    ASSERT_EQ(build_track_rows(c.views, c.limits, kSigma, rows), Status::kOk);
    const FullRows full = full_rows(c, rows.feature);
    const Dense& f = full.by_feature;
    const Dense blind = Dense::Identity(f.rows(), f.rows()) - f * test::inverse(test::gram(f)) * f.transpose();
    EXPECT_LT((blind * f).norm(), 1e-8 * f.norm());
    const Dense expected = test::congruent(full.poses_and_residual.transpose(), blind);
    const Dense pose_rows = dense(rows.pose_rows());
    ASSERT_EQ(pose_rows.rows(), index(2 * c.views.size()) - 3);
    EXPECT_LT((test::gram(pose_rows) - expected).norm(), 1e-9 * expected.norm());
  });
}

TEST(TrackRows, NothingIsLostInTheSplit) {
  test::for_all(200, [](test::Generator& g) {
    const TrackCase c = any_track(g, kSigma);
    Rows rows;
    ASSERT_EQ(build_track_rows(c.views, c.limits, kSigma, rows), Status::kOk);
    const FullRows full = full_rows(c, rows.feature);
    Dense before(full.by_feature.rows(), index(Rows::kColumns));
    before << full.by_feature, full.poses_and_residual;
    const Dense after = dense(rows.work.view(rows.rows, Rows::kColumns));
    EXPECT_LT((test::gram(after) - test::gram(before)).norm(), 1e-10 * before.squaredNorm());
    for (std::size_t r = 1; r < 3; ++r) {
      for (std::size_t k = 0; k < r; ++k) EXPECT_EQ(rows.feature_rows()(r, k), 0.0);
    }
  });
}

TEST(TrackRows, SeeNoCommonDisplacement) {
  test::for_all(200, [](test::Generator& g) {
    const TrackCase c = any_track(g, kSigma);
    Rows rows;
    ASSERT_EQ(build_track_rows(c.views, c.limits, kSigma, rows), Status::kOk);
    Dense together(index(Rows::kPoseColumns), 6);
    for (std::size_t slot = 0; slot < test::kTrackPoses; ++slot) together.middleRows<6>(index(6 * slot)).setIdentity();
    const Dense h = dense(rows.pose_rows()).leftCols(index(Rows::kPoseColumns));
    EXPECT_LT((h * together).norm(), 1e-9 * h.norm());
  });
}

// The published bound: as many degrees of freedom as there are rows, which is twice the length less three (F5). The
// innovation is that of the pose rows, though computed from the rows they come from.
TEST(TrackRows, TheInnovationIsThatOfAsManyRowsAsThereAreDegreesOfFreedom) {
  test::for_all(200, [](test::Generator& g) {
    const TrackCase c = any_track(g, kSigma);
    Rows rows;
    ASSERT_EQ(build_track_rows(c.views, c.limits, kSigma, rows), Status::kOk);
    Dense p = test::any_covariance(g, Rows::kPoseColumns) * 1e-5;
    static MatrixStorage<Rows::kPoseColumns, Rows::kPoseColumns> covariance;
    test::store(p, covariance.view());
    const Dense all = dense(rows.pose_rows());
    const Dense poses = all.leftCols(index(Rows::kPoseColumns));
    const Eigen::VectorXd r = all.rightCols<1>();
    const Dense s = test::congruent(poses, p) + Dense::Identity(all.rows(), all.rows());
    const double nis = r.dot(test::inverse(s) * r);
    EXPECT_EQ(rows.pose_rows().rows(), 2 * c.views.size() - 3);
    EXPECT_NEAR(innovation_squared(rows, covariance.view()), nis, 1e-9 * (1.0 + nis));
  });
}

TEST(TrackRows, RefusesATrackThatDoesNotTellDepth) {
  test::for_all(100, [](test::Generator& g) {
    TrackCase c = any_track(g, kSigma);
    c.limits.min_parallax = 0.0;  // let it through to the conditioning check
    for (View& view : c.views) {
      view.z = (view.camera.R_WC.transpose() * c.views[0].camera.R_WC * c.views[0].z.homogeneous()).hnormalized();
      view.camera.p_WC_m = c.views[0].camera.p_WC_m + g.normal_vector<3>(1e-9);
    }
    Rows rows;
    EXPECT_FALSE(ok(build_track_rows(c.views, c.limits, kSigma, rows)));
  });
}

}  // namespace
}  // namespace plumb
