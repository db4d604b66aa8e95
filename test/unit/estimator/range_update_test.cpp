// What becomes of a range: the facet it hits, the checks, the gate. The update's numbers are the subject of
// test/law/filter_laws_test.cpp.

#include "fsw/estimator/range_update.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <memory>

#include "test/support/estimator_cases.h"

namespace plumb {
namespace {

using test::TinyConfig;
using State = FilterState<TinyConfig>;
using Stack = UpdateStack<TinyConfig>;

/// A camera over a plane given in its own frame: the beam meets it where plane geometry says.
struct Case {
  SensorCalibration calibration = test::nadir_calibration();
  RangeOptions options;
  std::unique_ptr<State> state = std::make_unique<State>();
  std::unique_ptr<Stack> stack = std::make_unique<Stack>();
  FrameReport report;
  Vec3 normal = Vec3::UnitZ();
  double distance_m = 5.0;

  double range_m() const { return (distance_m - normal.dot(calibration.p_CR_m)) / normal.dot(calibration.u_C); }
  Status fuse(double measured_m) {
    RangeUpdate<TinyConfig> update(options);
    report = {};
    return update.fuse(*state, *stack, measured_m, report);
  }
  /// Another beam than that of the calibration file.
  void aim(const Vec3& origin_C_m, const Vec3& direction_C) {
    calibration.p_CR_m = origin_C_m;
    calibration.u_C = direction_C.normalized();
    state->set_calibration(calibration, {});
  }
  /// A feature of the plane at this image point of the present camera, known to one percent.
  void add_feature(std::uint32_t id, const Vec2& z) {
    const CameraPose camera = test::camera_of(state->core, calibration);
    const Vec3 point = camera.p_WC_m + camera.R_WC * z.homogeneous() * distance_m / normal.dot(z.homogeneous());
    const std::size_t anchor = state->window().front();
    SlamFeature f{id, anchor, test::feature_of(state->pose(anchor).camera, point), 0};
    const Vec3 sigmas(0.001, 0.001, 0.01 * f.parameters.z());
    ASSERT_EQ(state->add_feature(f, Mat3(sigmas.cwiseAbs2().asDiagonal())), Status::kOk);
  }
};

/// A level flight with no features yet; the plane is tilted by up to 30 degrees to the image plane.
Case any_case(test::Generator& g) {
  Case c;
  test::fill_state(g, c.calibration, 0, *c.state);
  c.normal =
      (so3_exp(g.uniform(0.0, 0.5) * Vec3(g.direction().x(), g.direction().y(), 0.0)) * Vec3::UnitZ()).normalized();
  return c;
}

void add_triangle(Case& c, std::uint32_t first_id, const Vec2& centre, double size) {
  c.add_feature(first_id, centre + size * Vec2(0.0, 1.0));
  c.add_feature(first_id + 1, centre + size * Vec2(-0.9, -0.6));
  c.add_feature(first_id + 2, centre + size * Vec2(0.9, -0.6));
}

// Direction and lever arm of the beam are the calibrated ones; along an off-axis beam the range is longer than the
// depth (F4), and the range finder does not stand where the camera does.
TEST(RangeUpdate, PredictsTheRangeAlongTheCalibratedBeam) {
  test::for_all(200, [](test::Generator& g) {
    Case c = any_case(g);
    const Vec3 origin = g.normal_vector<3>(0.1);
    c.aim(origin, Vec3(g.uniform(-0.3, 0.3), g.uniform(-0.3, 0.3), 1.0));
    const Vec3 impact = c.calibration.p_CR_m + c.range_m() * c.calibration.u_C;
    add_triangle(c, 1, impact.head<2>() / impact.z(), 0.15);
    ASSERT_EQ(c.fuse(c.range_m()), Status::kOk);
    EXPECT_EQ(c.report.range_outcome, RangeOutcome::kUsed);
    EXPECT_NEAR(c.report.range_predicted_m, c.range_m(), 1e-9);
    EXPECT_EQ(c.report.ranges_used, 1U);
    EXPECT_GT(c.report.range_sigma_m, c.options.noise_m);
  });
}

TEST(RangeUpdate, AnOffAxisBeamIsLongerThanTheDepth) {
  test::for_all(1, [](test::Generator& g) {
    Case c = any_case(g);
    c.normal = Vec3::UnitZ();
    c.aim(Vec3::Zero(), Vec3(std::sin(0.1745), 0.0, std::cos(0.1745)));  // 10 degrees
    add_triangle(c, 1, Vec2(std::tan(0.1745), 0.0), 0.15);
    ASSERT_EQ(c.fuse(5.0 / std::cos(0.1745)), Status::kOk);
    EXPECT_NEAR(c.report.range_predicted_m, 5.0 / std::cos(0.1745), 1e-9);  // 5.077 m, not 5
  });
}

// Search and model use one beam (F3): of two facets, the one under the beam, not the one on the optical axis.
TEST(RangeUpdate, LooksForTheFacetWhereTheBeamHits) {
  test::for_all(50, [](test::Generator& g) {
    Case c = any_case(g);
    c.aim(c.calibration.p_CR_m, Vec3(0.35, 0.0, 1.0));
    const Vec3 impact = c.calibration.p_CR_m + c.range_m() * c.calibration.u_C;
    add_triangle(c, 1, Vec2(0.0, 0.0), 0.1);
    add_triangle(c, 11, impact.head<2>() / impact.z(), 0.1);
    ASSERT_EQ(c.fuse(c.range_m()), Status::kOk);
    ASSERT_EQ(c.report.range_outcome, RangeOutcome::kUsed);
    for (const auto id : c.report.range_facet) EXPECT_GE(id, 11U);
  });
}

/// The outcome, and that nothing was done to the state.
void expect_unused(Case& c, double range_m, RangeOutcome outcome) {
  const std::uint64_t before = c.state->hash();
  ASSERT_EQ(c.fuse(range_m), Status::kOk);
  EXPECT_EQ(c.report.range_outcome, outcome);
  EXPECT_EQ(c.report.ranges_used, 0U);
  EXPECT_EQ(c.state->hash(), before);
}

TEST(RangeUpdate, WithoutAFacetThereIsNoUpdate) {
  test::for_all(50, [](test::Generator& g) {
    Case none = any_case(g);
    expect_unused(none, 5.0, RangeOutcome::kNoFacet);
    Case beside = any_case(g);
    add_triangle(beside, 1, Vec2(0.4, 0.3), 0.1);
    expect_unused(beside, beside.range_m(), RangeOutcome::kNoFacet);
  });
}

TEST(RangeUpdate, VerticesOfUnknownDepthAreNoFacet) {
  test::for_all(50, [](test::Generator& g) {
    Case c = any_case(g);
    add_triangle(c, 1, Vec2::Zero(), 0.15);
    const std::size_t at = ErrorLayout<TinyConfig>::feature(static_cast<std::size_t>(g.integer(0, 2))) + 2;
    c.state->covariance()(at, at) = 1.0;  // sigma of 1/m for an inverse depth of 0.2
    expect_unused(c, c.range_m(), RangeOutcome::kNoFacet);
    Case negative = any_case(g);
    add_triangle(negative, 1, Vec2::Zero(), 0.15);
    negative.state->features[1].parameters.z() *= -1.0;
    expect_unused(negative, negative.range_m(), RangeOutcome::kNoFacet);
  });
}

TEST(RangeUpdate, AFacetTooLargeOrTooSteepIsRefused) {
  test::for_all(50, [](test::Generator& g) {
    Case large = any_case(g);
    add_triangle(large, 1, Vec2::Zero(), 0.5);
    expect_unused(large, large.range_m(), RangeOutcome::kBadGeometry);
    Case steep = any_case(g);
    steep.normal = so3_exp(Vec3(0.0, 80.0 * 0.01745, 0.0)) * Vec3::UnitZ();
    steep.distance_m = 1.0;
    add_triangle(steep, 1, Vec2(0.02, 0.0), 0.08);
    expect_unused(steep, steep.range_m(), RangeOutcome::kBadGeometry);
  });
}

TEST(RangeUpdate, AnOutlierIsGatedAndLeavesNoTrace) {
  test::for_all(50, [](test::Generator& g) {
    Case c = any_case(g);
    add_triangle(c, 1, Vec2::Zero(), 0.15);
    const double factor = g.integer(0, 1) == 0 ? g.uniform(0.3, 0.7) : g.uniform(1.5, 6.0);
    expect_unused(c, factor * c.range_m(), RangeOutcome::kGated);
  });
}

// The gate is at the declared number of sigmas of the declared innovation.
TEST(RangeUpdate, TheGateIsWhereItIsSaidToBe) {
  test::for_all(50, [](test::Generator& g) {
    Case c = any_case(g);
    add_triangle(c, 1, Vec2::Zero(), 0.15);
    // The innovation is that of the inverse range, so its sigma belongs to the measured value: find the crossing.
    double inside = 0.0;
    double outside = 3.0;
    for (int k = 0; k < 40; ++k) {
      const double middle = 0.5 * (inside + outside);
      Case trial = any_case(g);
      *trial.state = *c.state;
      trial.normal = c.normal;
      ASSERT_EQ(trial.fuse(c.range_m() + middle), Status::kOk);
      (trial.report.range_outcome == RangeOutcome::kUsed ? inside : outside) = middle;
      c.report = trial.report;
    }
    EXPECT_NEAR(inside, c.options.gate_sigma * c.report.range_sigma_m, 1e-6);
  });
}

// A range on the same spot says nothing about the ground that the last one did not; one far away is the first again.
// The ground about the facet is off its plane: what one range has told of it, the next one at the same place does not
// tell again.
TEST(RangeUpdate, OverRoughGroundARepeatedRangeTellsLittle) {
  test::for_all(20, [](test::Generator& g) {
    Case c = any_case(g);
    add_triangle(c, 1, Vec2::Zero(), 0.15);
    const double plane_m = c.distance_m;
    const double turn = g.uniform(0.0, 6.0);
    for (std::uint32_t k = 0; k < 3; ++k) {
      c.distance_m = plane_m * (k == 1 ? 1.2 : 0.8);
      c.add_feature(10 + k, 0.3 * Vec2(std::cos(turn + 2.0 * k), std::sin(turn + 2.0 * k)));
    }
    c.distance_m = plane_m;
    RangeUpdate<TinyConfig> update(c.options);
    const auto innovation_sigma = [&] {
      State untouched = *c.state;
      c.report = {};
      EXPECT_EQ(update.fuse(untouched, *c.stack, c.range_m(), c.report), Status::kOk);
      EXPECT_EQ(c.report.range_outcome, RangeOutcome::kUsed);
      return c.report.range_sigma_m;
    };
    const double first = innovation_sigma();
    EXPECT_GT(innovation_sigma(), 10.0 * first);
    update.clear();
    EXPECT_DOUBLE_EQ(innovation_sigma(), first);
  });
}

TEST(FacetRepeats, AnErrorThatRepeatsCountsOnce) {
  constexpr double kNoise_m = 0.03;
  constexpr double kRelief_m = 0.5;
  constexpr double kFacet_m = 3.0;
  const double once = kNoise_m * kNoise_m + kRelief_m * kRelief_m;
  const Vec3 here(1.0, -2.0, 0.3);
  FacetRepeats repeats;
  EXPECT_DOUBLE_EQ(repeats.variance(here, kFacet_m, kNoise_m, kRelief_m), once);
  repeats.used(here);
  EXPECT_GT(repeats.variance(here, kFacet_m, kNoise_m, kRelief_m), 1000.0 * once);
  EXPECT_DOUBLE_EQ(repeats.variance(here, kFacet_m, kNoise_m, 0.0), kNoise_m * kNoise_m);
  double last = std::numeric_limits<double>::infinity();
  for (double away_m = 0.1; away_m < 100.0; away_m *= 2.0) {
    const double variance = repeats.variance(here + Vec3(0.0, away_m, 0.0), kFacet_m, kNoise_m, kRelief_m);
    EXPECT_LT(variance, last);
    last = variance;
  }
  EXPECT_NEAR(last, once, 1e-6);
  repeats.clear();
  EXPECT_DOUBLE_EQ(repeats.variance(here, kFacet_m, kNoise_m, kRelief_m), once);
}

// What the law says of information: ranges a step apart along the ground, with an error of first order, tell as much of
// a constant as independent ones of this variance.
TEST(FacetRepeats, CarriesTheInformationOfCorrelatedRanges) {
  constexpr double kRelief_m = 0.5;
  constexpr double kNoise_m = 0.01;
  constexpr double kFacet_m = 2.0;
  constexpr double kStep_m = 0.1;
  constexpr Eigen::Index kRanges = 800;
  Eigen::MatrixXd covariance(kRanges, kRanges);
  for (Eigen::Index i = 0; i < kRanges; ++i) {
    for (Eigen::Index j = 0; j < kRanges; ++j) {
      const double apart_m = kStep_m * static_cast<double>(std::abs(i - j));
      covariance(i, j) = kRelief_m * kRelief_m * std::exp(-apart_m / kFacet_m) + (i == j ? kNoise_m * kNoise_m : 0.0);
    }
  }
  const Eigen::VectorXd ones = Eigen::VectorXd::Ones(kRanges);
  const double information = ones.dot(covariance.llt().solve(ones));
  FacetRepeats repeats;
  repeats.used(Vec3::Zero());
  const double white = repeats.variance(Vec3(kStep_m, 0.0, 0.0), kFacet_m, kNoise_m, kRelief_m);
  EXPECT_NEAR(static_cast<double>(kRanges) / white, information, 0.1 * information);
}

}  // namespace
}  // namespace plumb
