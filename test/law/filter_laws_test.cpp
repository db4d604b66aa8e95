// What one image and one range do to the filter, against the same measurements written out in full: every observation
// of every feature in one dense joint estimate, with Jacobians by differences of the true retraction.

#include <gtest/gtest.h>

#include <memory>

#include "fsw/estimator/range_update.h"
#include "test/support/dense_filter.h"
#include "test/support/visual_case.h"

namespace plumb {
namespace {

using test::Dense;
using test::dense;
using test::index;
using test::TinyConfig;
using State = FilterState<TinyConfig>;
using Layout = ErrorLayout<TinyConfig>;
using Stack = UpdateStack<TinyConfig>;
using test::NewTrack;

/// Most laws are about what is used: a gate that lets everything pass and costs nothing.
struct Case : test::VisualCase {
  explicit Case(double gate = 1.0 - 1e-9) : VisualCase(options(gate)) {}
  static VisionOptions options(double gate) {
    VisionOptions options = test::visual_case_options();
    options.gate_probability = gate;
    return options;
  }
};

/// Variance of an observation, on the normalised image plane, as it goes into the estimate.
struct Noise {
  double slam = test::kImageSigma * test::kImageSigma;
  double track = test::kImageSigma * test::kImageSigma;
};

struct Joint {
  Eigen::VectorXd mean;  ///< correction of the state, then of each new feature
  Dense covariance;
  std::vector<FeatureParameters> start;  ///< where each new feature is linearised
};

/// Residual rows of one new track against its triangulated point, appended to the joint information.
void add_track(const State& state, const NewTrack& t, double variance, std::size_t column, Dense& information,
               Eigen::VectorXd& vector, Joint& out) {
  Views views;
  for (std::size_t k = t.first; k <= t.last; ++k) {
    const std::size_t slot = state.window()[k];
    ASSERT_EQ(views.push_back({state.pose(slot).camera, t.z[k - t.first], slot}), Status::kOk);
  }
  TriangulationLimits limits;
  limits.min_parallax = 0.0;
  const Result<FeatureParameters> start = triangulate(views, views.size() - 1, limits);
  ASSERT_TRUE(start.has_value());
  out.start.push_back(*start);
  const std::size_t anchor = state.window()[t.last];
  for (std::size_t k = t.first; k <= t.last; ++k) {
    const std::size_t slot = state.window()[k];
    const auto predict = [&](const State& s, const Vec3& feature) {
      VisualPrediction p;
      EXPECT_EQ(predict_feature(s.pose(slot).camera, s.pose(anchor).camera, feature, p), Status::kOk);
      return p.z;
    };
    Dense h = Dense::Zero(2, information.cols());
    h.leftCols(index(state.size())) =
        test::numeric_state_jacobian(state, 2, [&](const State& s) { return predict(s, *start); });
    h.middleCols<3>(index(column)) =
        test::numeric_jacobian<2, 3>([&](const Vec3& e) { return predict(state, *start + e); }, 1e-6);
    const Vec2 r = t.z[k - t.first] - predict(state, *start);
    information += test::gram(h) / variance;
    vector += h.transpose() * r / variance;
  }
}

/// Everything the image brings, in information form: prior on the state, none on the new features.
Joint joint_estimate(const Case& c, const Noise& noise) {
  const State& state = *c.state;
  const std::size_t n = state.size();
  const std::size_t total = n + 3 * c.added.size();
  Dense information = Dense::Zero(index(total), index(total));
  information.topLeftCorner(index(n), index(n)) = test::inverse(dense(state.covariance()));
  Eigen::VectorXd vector = Eigen::VectorXd::Zero(index(total));
  Joint out;
  for (std::size_t i = 0; i < c.slam_z.size(); ++i) {
    const auto predict = [i](const State& s) {
      const CameraPose& anchor = s.pose(s.features[i].anchor_slot).camera;
      return Vec2(test::feature_of(s.newest().camera, feature_in_world(anchor, s.features[i].parameters)).head<2>());
    };
    Dense h = Dense::Zero(2, index(total));
    h.leftCols(index(n)) = test::numeric_state_jacobian(state, 2, predict);
    information += test::gram(h) / noise.slam;
    vector += h.transpose() * (c.slam_z[i] - predict(state)) / noise.slam;
  }
  for (std::size_t i = 0; i < c.added.size(); ++i)
    add_track(state, c.added[i], noise.track, n + 3 * i, information, vector, out);
  out.covariance = test::inverse(information);
  out.mean = out.covariance * vector;
  return out;
}

/// Runs the filter and compares: `started` of the added tracks must now be features, in any order; the rest is gone.
void expect_joint(Case& c, std::size_t started, const Noise& noise = {}) {
  const Joint joint = joint_estimate(c, noise);
  const std::size_t n = c.state->size();
  const std::size_t slam = c.slam_z.size();
  State expected = *c.state;
  const Eigen::VectorXd dx = joint.mean.head(index(n));
  expected.retract(dx.data());
  ASSERT_EQ(c.run(), Status::kOk);
  ASSERT_EQ(c.report.slam_used, slam);
  ASSERT_EQ(c.report.msckf_used, c.added.size());
  ASSERT_EQ(c.report.slam_added, started);
  ASSERT_EQ(c.state->features.size(), slam + started);

  std::vector<Eigen::Index> rows;  // where each row of the filter's covariance stands in the joint one
  for (std::size_t k = 0; k < n; ++k) rows.push_back(index(k));
  State known = *c.state;
  while (known.features.size() > slam) known.remove_feature(known.features.size() - 1);
  test::expect_same_nominal(expected, known, 1e-6);
  for (std::size_t f = slam; f < c.state->features.size(); ++f) {
    std::size_t i = 0;
    while (c.added[i].id != c.state->features[f].track_id) ++i;
    const FeatureParameters reference = joint.start[i] + joint.mean.segment<3>(index(n + 3 * i));
    EXPECT_LT((c.state->features[f].parameters - reference).norm(), 1e-5 * reference.norm());
    EXPECT_EQ(c.state->features[f].anchor_slot, c.state->window().back());
    for (std::size_t k = 0; k < 3; ++k) rows.push_back(index(n + 3 * i + k));
  }
  const auto size = static_cast<Eigen::Index>(rows.size());
  Dense reference(size, size);
  for (Eigen::Index r = 0; r < size; ++r) {
    for (Eigen::Index k = 0; k < size; ++k) {
      reference(r, k) = joint.covariance(rows[static_cast<std::size_t>(r)], rows[static_cast<std::size_t>(k)]);
    }
  }
  EXPECT_LT(test::covariance_difference(reference, dense(c.state->covariance())), 1e-5);
  test::expect_symmetric_bit_for_bit(c.state->covariance());
}

TEST(VisualUpdateLaw, SlamObservationsAreTheDenseUpdate) {
  test::for_all(20, [](test::Generator& g) {
    Case c;
    c.fill(g, 6, 0, 0);
    c.append_frames();
    expect_joint(c, 0);
  });
}

TEST(VisualUpdateLaw, MsckfIsTheJointEstimateWithTheFeaturesMarginalisedOut) {
  test::for_all(20, [](test::Generator& g) {
    Case c;
    c.fill(g, 0, 0, 4);
    c.append_frames();
    expect_joint(c, 0);
  });
}

TEST(VisualUpdateLaw, DelayedInitialisationIsTheJointEstimate) {
  test::for_all(20, [](test::Generator& g) {
    Case c;
    c.fill(g, 0, 3, 0);
    c.append_frames();
    expect_joint(c, 3);
  });
}

TEST(VisualUpdateLaw, AllOfItTogetherIsOneJointEstimate) {
  test::for_all(20, [](test::Generator& g) {
    Case c;
    c.fill(g, 3, 3, 2);
    c.append_frames();
    expect_joint(c, 3);
  });
}

// What passes a gate pays for the good observations that the gate refuses: its noise is raised by what they cost.
TEST(VisualUpdateLaw, WhatPassesTheGatePays) {
  constexpr double kGate = 0.999;
  const ChiSquareTable gate(kGate);
  test::for_all(20, [&gate](test::Generator& g) {
    Case c(kGate);
    c.fill(g, 4, 0, 4);
    c.append_frames();
    const std::size_t track_rows = 2 * c.added.front().z.size() - 3;  // those that see poses only
    Noise noise;
    noise.slam *= gate.cost(2);
    noise.track *= gate.cost(track_rows);
    expect_joint(c, 0, noise);
  });
}

// The hidden fault of filters without care for it: heading and position that become known by looking at landmarks.
TEST(VisualUpdateLaw, AnImageTellsNothingOfTheUnobservable) {
  test::for_all(20, [](test::Generator& g) {
    Case c;
    c.fill(g, 4, 0, 4);
    c.append_frames();
    const Dense directions = test::unobservable_directions(*c.state);
    const Dense before = dense(c.state->covariance());
    ASSERT_EQ(c.run(), Status::kOk);
    ASSERT_EQ(c.report.slam_used, 4U);
    ASSERT_EQ(c.report.msckf_used, 4U);
    EXPECT_LT(test::false_information(before, dense(c.state->covariance()), directions), 1e-8);
  });
}

/// Three well known features about the point the beam hits.
struct RangeCase {
  SensorCalibration calibration = test::nadir_calibration();
  std::unique_ptr<State> state = std::make_unique<State>();
  std::unique_ptr<Stack> stack = std::make_unique<Stack>();
  RangeOptions options;
};

double range_of(const State& state) {
  const SensorCalibration& calibration = state.calibration().sensors();
  std::array<Vec3, 3> f;
  for (std::size_t j = 0; j < 3; ++j) {
    f[j] = feature_in_world(state.pose(state.features[j].anchor_slot).camera, state.features[j].parameters);
  }
  const CameraPose camera = test::camera_of(state.core, calibration);
  const Vec3 origin = camera.p_WC_m + camera.R_WC * calibration.p_CR_m;
  const Vec3 n = (f[0] - f[1]).cross(f[2] - f[1]);
  return (f[1] - origin).dot(n) / (camera.R_WC * calibration.u_C).dot(n);
}

void fill(test::Generator& g, RangeCase& c) {
  test::fill_state(g, c.calibration, 3, *c.state);
  const CameraPose camera = test::camera_of(c.state->core, c.calibration);
  for (std::size_t j = 0; j < 3; ++j) {
    const double angle = 2.1 * static_cast<double>(j) + g.uniform(-0.2, 0.2);
    const Vec3 seen(g.uniform(0.2, 0.3) * std::cos(angle), g.uniform(0.2, 0.3) * std::sin(angle), 1.0);
    const Vec3 point = camera.p_WC_m + camera.R_WC * seen * g.uniform(4.5, 5.5);
    SlamFeature& f = c.state->features[j];
    f.parameters = test::feature_of(c.state->pose(f.anchor_slot).camera, point);
  }
  c.options.gate_sigma = 5.0;
}

// Fused as an inverse range, which is what it is called in the source: value 1/z, sigma / z^2.
TEST(RangeUpdateLaw, ARangeIsTheDenseUpdate) {
  test::for_all(40, [](test::Generator& g) {
    RangeCase c;
    fill(g, c);
    const double predicted = range_of(*c.state);
    const double measured = predicted + g.normal(0.1);
    const auto inverse = [&](const State& s) { return Eigen::VectorXd::Constant(1, 1.0 / range_of(s)); };
    test::DenseRows rows;
    rows.h = test::numeric_state_jacobian(*c.state, 1, inverse);
    rows.r = Eigen::VectorXd::Constant(1, 1.0 / measured - 1.0 / predicted);
    const double noise_m = c.options.noise_m * std::sqrt(gate_cost(c.options.gate_sigma * c.options.gate_sigma, 1));
    rows.sigma = Eigen::VectorXd::Constant(1, noise_m / (measured * measured));
    const test::DensePosterior expected = test::dense_update(dense(c.state->covariance()), rows);
    State moved = *c.state;
    moved.retract(expected.dx.data());
    FrameReport report;
    RangeUpdate<TinyConfig> update(c.options);
    ASSERT_EQ(update.fuse(*c.state, *c.stack, measured, report), Status::kOk);
    ASSERT_EQ(report.range_outcome, RangeOutcome::kUsed);
    EXPECT_NEAR(report.range_predicted_m, predicted, 1e-9);
    test::expect_same_nominal(*c.state, moved, 1e-6);
    EXPECT_LT(test::covariance_difference(expected.p, dense(c.state->covariance())), 1e-5);
    test::expect_symmetric_bit_for_bit(c.state->covariance());
  });
}

TEST(RangeUpdateLaw, ARangeTellsScaleAndNothingOfTheUnobservable) {
  test::for_all(40, [](test::Generator& g) {
    RangeCase c;
    fill(g, c);
    const Dense directions = test::unobservable_directions(*c.state);
    const Dense before = dense(c.state->covariance());
    FrameReport report;
    RangeUpdate<TinyConfig> update(c.options);
    ASSERT_EQ(update.fuse(*c.state, *c.stack, range_of(*c.state), report), Status::kOk);
    ASSERT_EQ(report.range_outcome, RangeOutcome::kUsed);
    const Dense after = dense(c.state->covariance());
    EXPECT_LT(test::false_information(before, after, directions), 1e-8);
    // Stretching the scene about the camera is seen, and the better the nearer the prior was to knowing nothing of it.
    Eigen::VectorXd scale = Eigen::VectorXd::Zero(index(c.state->size()));
    for (std::size_t j = 0; j < 3; ++j) scale(index(Layout::feature(j) + 2)) = c.state->features[j].parameters.z();
    EXPECT_GT(scale.dot(test::inverse(after) * scale), scale.dot(test::inverse(before) * scale) * (1.0 + 1e-6));
  });
}

}  // namespace
}  // namespace plumb
