#include "fsw/estimator/filter_state.h"

#include <gtest/gtest.h>

#include <limits>
#include <memory>

#include "test/support/dense_filter.h"

namespace plumb {
namespace {

using test::Dense;
using test::dense;
using test::index;
using test::TinyConfig;
using State = FilterState<TinyConfig>;
using Layout = ErrorLayout<TinyConfig>;

struct Case {
  SensorCalibration calibration = test::nadir_calibration();
  std::unique_ptr<State> state = std::make_unique<State>();
  std::vector<Vec3> points;
};

Case any_case(test::Generator& g, std::size_t features) {
  Case c;
  c.points = test::fill_state(g, c.calibration, features, *c.state);
  return c;
}

/// Covariance of feature i as a point in the world, by its true derivative.
Mat3 world_covariance(const State& state, std::size_t i) {
  const Dense j = test::numeric_state_jacobian(state, 3, [i](const State& s) {
    return feature_in_world(s.pose(s.features[i].anchor_slot).camera, s.features[i].parameters);
  });
  return test::congruent(j, dense(state.covariance()));
}

TEST(FilterState, TheWorldBeginsHereAndNothingElseIsForgotten) {
  test::for_all(100, [](test::Generator& g) {
    Case c = any_case(g, 0);
    State& state = *c.state;
    while (!state.window().empty()) state.drop_pose(0);
    const Dense before = dense(state.covariance());
    const KinematicState motion = state.core.motion;
    state.begin_world_here(1e-6);
    const Dense after = dense(state.covariance());
    EXPECT_EQ(state.core.motion.p_WI_m, Vec3::Zero());
    EXPECT_EQ(state.core.motion.v_WI_m_s, motion.v_WI_m_s);
    for (Eigen::Index i = 0; i < after.rows(); ++i) {
      for (Eigen::Index j = 0; j < after.cols(); ++j) {
        const auto here = [](Eigen::Index k) { return k >= index(kXiP) && k < index(kXiP) + 3; };
        const double expected = here(i) || here(j) ? (i == j ? 1e-12 : 0.0) : before(i, j);
        EXPECT_EQ(after(i, j), expected) << i << ", " << j;
      }
    }
  });
}

TEST(FilterState, ACloneIsTheCameraOfThisMoment) {
  test::for_all(100, [](test::Generator& g) {
    Case c = any_case(g, 2);
    State& state = *c.state;
    state.drop_pose(0);
    state.set_calibration(c.calibration, {});  // known: it adds nothing
    state.clone_camera(77);
    const CameraPose expected = test::camera_of(state.core, c.calibration);
    EXPECT_LT((state.newest().camera.R_WC - expected.R_WC).norm(), 1e-14);
    EXPECT_EQ(state.newest().camera.p_WC_m, expected.p_WC_m);
    EXPECT_EQ(state.slot_of(77), state.window().back());
    // Clone and IMU are one rigid body: whatever happens to one in an update happens to the other.
    const Dense p = dense(state.covariance());
    const auto at = index(Layout::pose(state.window().back()));
    EXPECT_EQ(p.middleRows(at, 6), p.middleRows(0, 6));
    std::vector<double> dx(state.size(), 0.0);
    const test::Vec6 e = g.normal_vector<6>(0.3);
    for (std::size_t k = 0; k < 6; ++k) dx[k] = dx[static_cast<std::size_t>(at) + k] = e(index(k));
    state.retract(dx.data());
    const CameraPose carried = test::camera_of(state.core, c.calibration);
    EXPECT_LT((state.newest().camera.R_WC - carried.R_WC).norm(), 1e-13);
    EXPECT_LT((state.newest().camera.p_WC_m - carried.p_WC_m).norm(), 1e-13);
  });
}

// Everything turns alike, so nothing that is seen from a pose changes; and turned back, the filter is as it was.
TEST(FilterState, TurningTheWorldTurnsEverythingInIt) {
  test::for_all(60, [](test::Generator& g) {
    Case c = any_case(g, 4);
    State& state = *c.state;
    const State before = state;
    const double yaw_rad = g.uniform(-3.0, 3.0);
    const Quat turn = so3_exp(Vec3(0.0, 0.0, yaw_rad));
    state.turn_world(yaw_rad, 0.0);
    EXPECT_LT((state.core.motion.p_WI_m - turn * before.core.motion.p_WI_m).norm(), 1e-12);
    EXPECT_LT((state.core.motion.v_WI_m_s - turn * before.core.motion.v_WI_m_s).norm(), 1e-12);
    for (std::size_t i = 0; i < 4; ++i) {
      const SlamFeature& f = state.features[i];
      const Vec3 turned = feature_in_world(state.pose(f.anchor_slot).camera, f.parameters);
      EXPECT_LT((turned - turn * c.points[i]).norm(), 1e-9);
      const Mat3 rotation = turn.toRotationMatrix();
      const Mat3 expected = rotation * world_covariance(before, i) * rotation.transpose();
      EXPECT_LT((world_covariance(state, i) - expected).norm(), 1e-6 * expected.norm());
    }
    test::expect_symmetric_bit_for_bit(state.covariance());
    state.turn_world(-yaw_rad, 0.0);
    test::expect_same_nominal(state, before, 1e-12);
    EXPECT_LT(test::covariance_difference(dense(before.covariance()), dense(state.covariance())), 1e-9);
  });
}

// An unknown heading is an error common to all poses: of all that is estimated only turns of everything gain variance.
TEST(FilterState, AnUnknownHeadingIsCommonToAllPoses) {
  test::for_all(30, [](test::Generator& g) {
    Case c = any_case(g, 3);
    State& state = *c.state;
    const Dense before = dense(state.covariance());
    state.turn_world(0.0, 0.5);
    Eigen::VectorXd heading = Eigen::VectorXd::Zero(index(state.size()));
    heading(index(kTheta + 2)) = 1.0;
    for (const std::size_t slot : state.window()) heading(index(Layout::pose(slot) + 2)) = 1.0;
    const Dense expected = before + 0.25 * heading * heading.transpose();
    EXPECT_LT(test::covariance_difference(expected, dense(state.covariance())), 1e-12);
    test::expect_symmetric_bit_for_bit(state.covariance());
  });
}

TEST(FilterState, ReanchoringKeepsPointsAndTheirCovariance) {
  test::for_all(60, [](test::Generator& g) {
    Case c = any_case(g, 5);
    State& state = *c.state;
    const auto leaving = static_cast<std::size_t>(g.integer(0, TinyConfig::kMaxPoses - 1));
    std::vector<Mat3> before;
    for (std::size_t i = 0; i < 5; ++i) before.push_back(world_covariance(state, i));
    const std::size_t slot = state.window()[leaving];
    state.drop_pose(leaving);
    ASSERT_EQ(state.features.size(), 5U);
    test::expect_symmetric_bit_for_bit(state.covariance());
    for (std::size_t i = 0; i < 5; ++i) {
      const SlamFeature& f = state.features[i];
      EXPECT_NE(f.anchor_slot, slot);
      EXPECT_LT((feature_in_world(state.pose(f.anchor_slot).camera, f.parameters) - c.points[i]).norm(), 1e-10);
      EXPECT_LT((world_covariance(state, i) - before[i]).norm(), 1e-6 * before[i].norm());
    }
    EXPECT_EQ(dense(state.covariance()).middleRows(index(Layout::pose(slot)), 6).norm(), 0.0);
  });
}

TEST(FilterState, AFeatureThatCannotMoveToAnotherAnchorIsRemoved) {
  test::for_all(50, [](test::Generator& g) {
    Case c = any_case(g, 3);
    State& state = *c.state;
    const std::size_t bad = static_cast<std::size_t>(g.integer(0, 2));
    state.features[bad].anchor_slot = state.window().front();
    state.features[bad].parameters.z() = g.integer(0, 1) == 0 ? 0.0 : -0.1;
    const std::uint32_t id = state.features[bad].track_id;
    state.drop_pose(0);
    EXPECT_EQ(state.features.size(), 2U);
    for (const SlamFeature& f : state.features) EXPECT_NE(f.track_id, id);
  });
}

TEST(FilterState, RemovingAFeatureTouchesNoOther) {
  test::for_all(100, [](test::Generator& g) {
    Case c = any_case(g, 6);
    State& state = *c.state;
    const auto gone = static_cast<std::size_t>(g.integer(0, 5));
    const Dense before = dense(state.covariance());
    const auto old_features = state.features;
    state.remove_feature(gone);
    const Dense after = dense(state.covariance());
    ASSERT_EQ(state.features.size(), 5U);
    std::vector<Eigen::Index> from;  // where each remaining row stood
    for (Eigen::Index k = 0; k < index(Layout::kFeatures); ++k) from.push_back(k);
    for (const SlamFeature& f : state.features) {
      std::size_t i = 0;
      while (old_features[i].track_id != f.track_id) ++i;
      EXPECT_EQ(f.parameters, old_features[i].parameters);
      for (std::size_t k = 0; k < 3; ++k) from.push_back(index(Layout::feature(i) + k));
    }
    for (Eigen::Index r = 0; r < after.rows(); ++r) {
      for (Eigen::Index q = 0; q < after.cols(); ++q) {
        ASSERT_EQ(after(r, q), before(from[static_cast<std::size_t>(r)], from[static_cast<std::size_t>(q)]));
      }
    }
  });
}

TEST(FilterState, ANewFeatureFindsACleanPlace) {
  test::for_all(50, [](test::Generator& g) {
    Case c = any_case(g, 4);
    State& state = *c.state;
    const SlamFeature again = state.features[1];
    state.remove_feature(1);
    const Mat3 covariance = test::any_covariance(g, 3);
    ASSERT_EQ(state.add_feature(again, covariance), Status::kOk);
    const Dense p = dense(state.covariance());
    const auto at = index(Layout::feature(3));
    EXPECT_EQ(Mat3(p.block<3, 3>(at, at)), covariance);
    EXPECT_EQ(p.block(at, 0, 3, at).norm(), 0.0);
    EXPECT_EQ(p.block(0, at, at, 3).norm(), 0.0);
  });
}

TEST(FilterState, RefusesMoreFeaturesThanThereAreSlots) {
  test::for_all(1, [](test::Generator& g) {
    Case c = any_case(g, TinyConfig::kMaxSlamFeatures);
    EXPECT_EQ(c.state->add_feature(c.state->features[0], Mat3::Identity()), Status::kFull);
    EXPECT_EQ(c.state->features.size(), TinyConfig::kMaxSlamFeatures);
  });
}

TEST(FilterState, TheWindowSlidesInOrderOfAge) {
  test::for_all(1, [](test::Generator& g) {
    Case c = any_case(g, 0);
    State& state = *c.state;
    constexpr std::uint32_t kFull = TinyConfig::kMaxPoses;
    for (std::uint32_t k = kFull; k < 40; ++k) {
      state.drop_pose(0);
      state.core = test::core_over_ground(g, k);
      state.clone_camera(k);
      ASSERT_EQ(state.window().size(), TinyConfig::kMaxPoses);
      for (std::size_t i = 0; i < TinyConfig::kMaxPoses; ++i) {
        ASSERT_EQ(state.pose(state.window()[i]).sequence, k + 1 - kFull + i);
      }
      ASSERT_EQ(state.newest().sequence, k);
      ASSERT_EQ(state.slot_of(k - kFull), TinyConfig::kMaxPoses);
    }
  });
}

TEST(FilterState, HealthSeesEveryBadNumber) {
  test::for_all(300, [](test::Generator& g) {
    Case c = any_case(g, 3);
    ASSERT_TRUE(c.state->healthy());
    const double bad[] = {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()};
    const double poison = bad[g.integer(0, 1)];
    const Eigen::Index axis = g.integer(0, 2);
    switch (g.integer(0, 6)) {
      case 0: c.state->core.motion.p_WI_m(axis) = poison; break;
      case 1: c.state->core.motion.v_WI_m_s(axis) = poison; break;
      case 2: c.state->core.motion.q_WI.coeffs()(axis) = poison; break;
      case 3: c.state->core.b_gyro_rad_s(axis) = poison; break;
      case 4: c.state->core.b_accel_m_s2(axis) = poison; break;
      case 5: c.state->features[1].parameters(axis) = poison; break;
      default: {
        const auto k = static_cast<std::size_t>(g.integer(0, static_cast<std::int64_t>(c.state->size()) - 1));
        const double values[] = {poison, 0.0, -1e-12};
        c.state->covariance()(k, k) = values[g.integer(0, 2)];
      }
    }
    EXPECT_FALSE(c.state->healthy());
  });
}

TEST(FilterState, TheHashSeesEveryBit) {
  test::for_all(100, [](test::Generator& g) {
    Case c = any_case(g, 3);
    const std::uint64_t before = c.state->hash();
    EXPECT_EQ(State(*c.state).hash(), before);
    const auto r = static_cast<std::size_t>(g.integer(0, static_cast<std::int64_t>(c.state->size()) - 1));
    const auto q = static_cast<std::size_t>(g.integer(0, static_cast<std::int64_t>(c.state->size()) - 1));
    double& element = c.state->covariance()(r, q);
    const double old = element;
    element = std::nextafter(element, 10.0);
    EXPECT_NE(c.state->hash(), before);
    element = old;
    EXPECT_EQ(c.state->hash(), before);
    double& alpha = c.state->features[1].parameters.x();
    alpha = std::nextafter(alpha, 10.0);
    EXPECT_NE(c.state->hash(), before);
  });
}

TEST(FilterState, ClearForgetsEverything) {
  test::for_all(1, [](test::Generator& g) {
    Case c = any_case(g, 3);
    c.state->clear();
    EXPECT_EQ(c.state->hash(), [] {
      auto fresh = std::make_unique<State>();
      fresh->clear();
      return fresh->hash();
    }());
    EXPECT_EQ(c.state->t, Time::never());
    EXPECT_TRUE(c.state->window().empty());
    EXPECT_TRUE(c.state->features.empty());
  });
}

}  // namespace
}  // namespace plumb
