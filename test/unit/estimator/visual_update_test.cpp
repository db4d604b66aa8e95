// What becomes of each kind of track: used, gated, started, evicted, dropped. The numbers themselves are the subject of
// test/law/filter_laws_test.cpp.

#include "fsw/estimator/visual_update.h"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "test/support/dense_filter.h"
#include "test/support/visual_case.h"

namespace plumb {
namespace {

using test::Dense;
using test::dense;
using test::index;
using test::NewTrack;
using test::TinyConfig;
using test::VisualCase;
using State = FilterState<TinyConfig>;
using Layout = ErrorLayout<TinyConfig>;

constexpr std::size_t kPoses = TinyConfig::kMaxPoses;

/// Prediction of feature i in the newest camera, and the covariance of its innovation in units of the image noise.
struct Innovation {
  Vec2 z;
  Mat2 s;
};
Innovation innovation(const State& state, std::size_t i) {
  const auto predict = [i](const State& s) {
    VisualPrediction p;
    EXPECT_EQ(predict_feature(s.newest().camera, s.pose(s.features[i].anchor_slot).camera, s.features[i].parameters, p),
              Status::kOk);
    return p.z;
  };
  const Dense h = test::numeric_state_jacobian(state, 2, predict) / test::kImageSigma;
  return {predict(state), h * dense(state.covariance()) * h.transpose() + Mat2::Identity()};
}

TEST(VisualUpdate, TheSlamGateHasTwoDegreesOfFreedom) {
  VisionOptions options = test::visual_case_options();
  options.gate_probability = 0.95;
  test::for_all(40, [&options](test::Generator& g) {
    VisualCase c(options);
    c.fill(g, 1, 0, 0);
    const Innovation predicted = innovation(*c.state, 0);
    const double angle = g.uniform(0.0, 6.28);
    const Vec2 aside(std::cos(angle), std::sin(angle));
    const double unit_nis = aside.dot(predicted.s.inverse() * aside);
    const bool inside = g.integer(0, 1) == 0;
    constexpr double kQuantile = 5.991464547107979;  // chi-square, 95 %, 2 degrees of freedom
    const double size = std::sqrt((inside ? 0.995 : 1.005) * kQuantile / unit_nis) * test::kImageSigma;
    c.slam_z[0] = predicted.z + size * aside;
    c.append_frames();
    const std::uint64_t before = c.state->hash();
    ASSERT_EQ(c.run(), Status::kOk);
    EXPECT_EQ(c.report.slam_used, inside ? 1U : 0U);
    EXPECT_EQ(c.report.slam_rejected, inside ? 0U : 1U);
    EXPECT_EQ(c.state->hash() == before, !inside);  // a rejected observation leaves no trace
  });
}

TEST(VisualUpdate, AFeatureThatIsRejectedAgainAndAgainIsEvicted) {
  test::for_all(10, [](test::Generator& g) {
    VisualCase c;
    c.fill(g, 3, 0, 0);
    c.slam_z[1] += Vec2(0.3, 0.2);
    c.append_frames();
    const std::uint32_t bad = c.state->features[1].track_id;
    const int limit = test::visual_case_options().max_rejections;
    int rounds = 0;
    const auto present = [&] {
      for (const SlamFeature& f : c.state->features) {
        if (f.track_id == bad) return true;
      }
      return false;
    };
    FeatureFrame<TinyConfig::kMaxTracks> frame;
    for (std::size_t i = 0; i < 3; ++i) {
      const SlamFeature& f = c.state->features[i];
      ASSERT_EQ(frame.observations.push_back({f.track_id, 0.0F, 0.0F, c.slam_z[i].x(), c.slam_z[i].y()}), Status::kOk);
    }
    for (; rounds < 20 && present(); ++rounds) {
      ASSERT_EQ(c.run(), Status::kOk);
      frame.sequence = c.state->newest().sequence;
      c.tracks->append(frame);  // the camera stands
    }
    EXPECT_GT(rounds, limit);
    EXPECT_LE(rounds, limit + 2);
    // Its track goes on in the images but is never believed again.
    for (int k = 0; k < 10; ++k) {
      ASSERT_EQ(c.run(), Status::kOk);
      EXPECT_FALSE(present());
      EXPECT_EQ(c.report.msckf_used + c.report.msckf_rejected, 0U);
      c.tracks->append(frame);
    }
  });
}

TEST(VisualUpdate, ASingleMissIsForgiven) {
  test::for_all(10, [](test::Generator& g) {
    VisualCase c;
    c.fill(g, 1, 0, 0);
    const Vec2 good = c.slam_z[0];
    const std::uint32_t id = c.state->features[0].track_id;
    for (int k = 0; k < 20; ++k) {
      c.slam_z[0] = k % 2 == 0 ? Vec2(good + Vec2(0.3, 0.0)) : good;
      c.tracks->clear();
      c.append_frames();
      ASSERT_EQ(c.run(), Status::kOk);
      ASSERT_EQ(c.state->features.size(), 1U);
      ASSERT_EQ(c.state->features[0].track_id, id);
    }
  });
}

// The velocity of a start in motion is wrong by centimetres a second, and it is long until the window is full. Where
// ranges told the scale, short tracks are not to be taken at one scale after another.
TEST(VisualUpdate, TracksThatGoOnAreUsedBeforeTheWindowIsFullAfterALivelyStart) {
  test::for_all(10, [](test::Generator& g) {
    for (const bool excited : {false, true}) {
      VisualCase c;
      c.fill(g, 0, 2, 0);
      for (NewTrack& track : c.added) {
        track.first = 1;
        track.z.erase(track.z.begin());
      }
      c.append_frames();
      c.state->drop_pose(0);
      ASSERT_EQ(c.run({.excited = excited, .ranges_to_come = false}), Status::kOk);
      EXPECT_EQ(c.report.msckf_used, excited ? 2U : 0U);
    }
  });
}

// A track that failed its gate must not come in by the other door (F9).
TEST(VisualUpdate, ARejectedTrackBecomesNoFeature) {
  test::for_all(40, [](test::Generator& g) {
    VisualCase c;
    c.fill(g, 0, 1, 0);
    c.added[0].z[2] += Vec2(0.0, 0.03);  // across the direction of flight: no depth explains it
    c.append_frames();
    const std::uint64_t before = c.state->hash();
    ASSERT_EQ(c.run(), Status::kOk);
    EXPECT_EQ(c.report.msckf_rejected, 1U);
    EXPECT_EQ(c.report.msckf_used, 0U);
    EXPECT_EQ(c.report.slam_added, 0U);
    EXPECT_EQ(c.state->hash(), before);
  });
}

/// Every pose of the window at the place of the newest: what a hover looks like.
void hover(State& state) {
  for (std::size_t k = 0; k < kPoses; ++k) {
    state.drop_pose(0);
    state.clone_camera(static_cast<std::uint32_t>(50 + k));
  }
}

// In hover a track tells nothing of depth: no triangulation, no singular inverse, a start on the prior alone (F8).
TEST(VisualUpdate, InHoverAFeatureStartsOnItsDepthPrior) {
  test::for_all(20, [](test::Generator& g) {
    VisualCase c;
    test::fill_state(g, c.calibration, 0, *c.state);
    hover(*c.state);
    NewTrack t;
    t.id = 300;
    const Vec3 point = test::any_ground_point(g);
    t.z.assign(kPoses, test::feature_of(c.state->newest().camera, point).head<2>());
    c.added.push_back(t);
    c.append_frames();
    c.tracks->find(300)->age = 100;
    ASSERT_EQ(c.run(), Status::kOk);
    EXPECT_EQ(c.report.msckf_used, 0U);
    ASSERT_EQ(c.report.slam_added, 1U);
    const SlamFeature& f = c.state->features[0];
    EXPECT_EQ(f.parameters, FeatureParameters(t.z.back().x(), t.z.back().y(), 0.2));
    EXPECT_EQ(f.anchor_slot, c.state->window().back());
    const Dense p = dense(c.state->covariance());
    const auto at = index(Layout::feature(0));
    const double s2 = test::kImageSigma * test::kImageSigma;
    EXPECT_LT((p.block<3, 3>(at, at) - Dense(Vec3(s2, s2, 0.01).asDiagonal())).norm(), 1e-15);
    EXPECT_EQ(p.block(at, 0, 3, at).norm(), 0.0);
    EXPECT_TRUE(c.tracks->find(300)->samples.empty());  // the observation that made it is spent
  });
}

// Tracks that end short of the window are used, not thrown away (F20); those too short are not.
TEST(VisualUpdate, EndedTracksAreUsedWhenLongEnough) {
  test::for_all(40, [](test::Generator& g) {
    VisionOptions options = test::visual_case_options();
    options.gate_probability = 0.999999;
    options.min_track_length = 3;
    VisualCase c(options);
    c.fill(g, 0, 0, 3);
    for (std::size_t i = 0; i < 3; ++i) {  // lengths 4, 3 and 2, all ending in the image before the newest
      NewTrack& t = c.added[i];
      t.first = i;
      t.z.erase(t.z.begin(), t.z.begin() + static_cast<std::ptrdiff_t>(t.first));
    }
    c.append_frames();
    ASSERT_EQ(c.run(), Status::kOk);
    EXPECT_EQ(c.report.msckf_used, 2U);
    EXPECT_TRUE(c.tracks->tracks().empty());  // and then they are gone
  });
}

// A feature is measured in the very image it is last seen in; when its track ends there is nothing left over (F21).
TEST(VisualUpdate, ALostFeatureLeavesWithItsTrack) {
  test::for_all(20, [](test::Generator& g) {
    VisualCase c;
    c.fill(g, 4, 0, 0);
    c.append_frames();
    ASSERT_EQ(c.run(), Status::kOk);
    EXPECT_EQ(c.report.slam_used + c.report.slam_rejected, 4U);
    for (const auto& track : c.tracks->tracks()) EXPECT_TRUE(track.samples.empty());
    FeatureFrame<TinyConfig::kMaxTracks> empty;
    empty.sequence = c.state->newest().sequence;
    c.tracks->append(empty);
    ASSERT_EQ(c.run(), Status::kOk);
    EXPECT_EQ(c.state->features.size(), 0U);
    EXPECT_TRUE(c.tracks->tracks().empty());
    EXPECT_TRUE(c.state->healthy());
  });
}

TEST(VisualUpdate, AnObservationIsUsedOnce) {
  test::for_all(20, [](test::Generator& g) {
    VisualCase c;
    c.fill(g, 2, 2, 1);
    c.append_frames();
    ASSERT_EQ(c.run(), Status::kOk);
    for (const auto& track : c.tracks->tracks()) EXPECT_TRUE(track.samples.empty()) << track.id;
  });
}

TEST(VisualUpdate, MoreTracksThanItsBudgetWaitForTheNextImage) {
  test::for_all(10, [](test::Generator& g) {
    VisualCase c;
    c.fill(g, 0, TinyConfig::kMaxMsckfPerFrame + 6, 0);
    c.append_frames();
    ASSERT_EQ(c.run(), Status::kOk);
    EXPECT_LE(c.report.msckf_used + c.report.msckf_rejected, TinyConfig::kMaxMsckfPerFrame);
    EXPECT_LE(c.state->features.size(), TinyConfig::kMaxSlamFeatures);
  });
}

// After a start the rows of features would take the filter's own changes of mind for knowledge of the scale: tracks are
// used, and features wait until the velocity is known, or no range is about to tell it.
TEST(VisualUpdate, FeaturesWaitForTheScale) {
  struct Wait {
    double velocity_sigma = 0.0;
    bool ranges_tell_scale = false;
    bool features = false;
  };
  for (const Wait& wait : {Wait{1e-3, true, false}, Wait{1.0, true, true}, Wait{1e-3, false, true}}) {
    test::for_all(5, [&wait](test::Generator& g) {
      VisionOptions options = test::visual_case_options();
      options.slam_velocity_sigma = wait.velocity_sigma;
      VisualCase c(options);
      c.fill(g, 0, 4, 2);
      c.append_frames();
      ASSERT_EQ(c.run({.excited = false, .ranges_to_come = wait.ranges_tell_scale}), Status::kOk);
      EXPECT_GT(c.report.msckf_used, 0U);
      EXPECT_EQ(!c.state->features.empty(), wait.features) << wait.velocity_sigma << ", " << wait.ranges_tell_scale;
    });
  }
}

/// A track as long as the window, of a point five metres away that the newest image has at `last`.
NewTrack long_track(const VisualCase& c, std::uint32_t id, const Vec2& last, test::Generator& g) {
  NewTrack track;
  track.id = id;
  const CameraPose& newest = c.state->newest().camera;
  const Vec3 point = newest.p_WC_m + newest.R_WC * last.homogeneous() * g.uniform(4.5, 5.5);
  for (std::size_t k = 0; k < kPoses; ++k) {
    track.z.push_back(test::feature_of(c.state->pose(c.state->window()[k]).camera, point).head<2>());
  }
  return track;
}

TEST(VisualUpdate, FeaturesSpreadOverTheImage) {
  test::for_all(10, [](test::Generator& g) {
    VisionOptions options = test::visual_case_options();
    options.tiles_x = 2;
    options.tiles_y = 1;
    options.gate_probability = 0.999999;
    VisualCase c(options);
    c.fill(g, 0, 0, 0);
    // Ten tracks in the left half with the lower numbers, three in the right half.
    for (std::uint32_t i = 0; i < 13; ++i) {
      c.added.push_back(long_track(c, 400 + i, Vec2(i < 10 ? g.uniform(-0.5, -0.1) : g.uniform(0.1, 0.5), 0.1), g));
    }
    c.append_frames();
    ASSERT_EQ(c.run(), Status::kOk);
    ASSERT_EQ(c.state->features.size(), TinyConfig::kMaxSlamFeatures);
    int right = 0;
    for (const SlamFeature& f : c.state->features) right += f.track_id >= 410 ? 1 : 0;
    EXPECT_EQ(right, 3);
  });
}

TEST(VisualUpdate, SomeFeaturesGoToTheLasersSpot) {
  for (const int wanted : {0, 2}) {
    test::for_all(10, [&](test::Generator& g) {
      VisionOptions options = test::visual_case_options();
      options.tiles_x = options.tiles_y = 1;
      options.spot_features = wanted;
      options.gate_probability = 0.999999;
      VisualCase c(options);
      c.fill(g, 0, 0, 0);
      // The beam leaves along the optical axis: the last four tracks are where it ends.
      for (std::uint32_t i = 0; i < 13; ++i) {
        const double side = i < 9 ? g.uniform(0.3, 0.5) : g.uniform(0.0, 0.1);
        c.added.push_back(long_track(c, 400 + i, Vec2(side, -0.1), g));
      }
      c.append_frames();
      ASSERT_EQ(c.run(), Status::kOk);
      const auto at_spot = [](const SlamFeature& f) { return f.track_id >= 409; };
      EXPECT_EQ(std::count_if(c.state->features.begin(), c.state->features.end(), at_spot), wanted);
    });
  }
}

TEST(VisualUpdate, AnUnsoundCovarianceIsReported) {
  test::for_all(10, [](test::Generator& g) {
    VisualCase c;
    c.fill(g, 3, 2, 1);
    c.append_frames();
    test::store(Dense::Constant(index(c.state->size()), index(c.state->size()), NAN), c.state->covariance());
    static_cast<void>(c.run());
    EXPECT_EQ(c.report.slam_used + c.report.msckf_used, 0U);
    EXPECT_FALSE(c.state->healthy());  // nothing has covered it up
  });
}

}  // namespace
}  // namespace plumb
