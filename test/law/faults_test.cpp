// The known faults of the reference implementation (docs/faults.md), each as a law that Plumb keeps. Those that are the
// business of one part alone stand in that part's unit test.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "fsw/base/mission_config.h"
#include "fsw/estimator/facet_search.h"
#include "fsw/estimator/range_model.h"
#include "test/support/estimator_cases.h"
#include "test/support/estimator_feed.h"

namespace plumb {
namespace {

using Feed = test::EstimatorFeed<Estimator<PaperConfig>>;
using test::TinyConfig;

double seconds(Time t) { return (t - sim::flight_epoch()).seconds(); }

// A correction whose first component is zero, or that is zero altogether, is a number like any other.
TEST(Faults, F01AnAttitudeCorrectionMayHaveZeroComponents) {
  test::for_all(500, [](test::Generator& g) {
    Vec3 theta = g.normal_vector<3>(std::pow(10.0, g.uniform(-12.0, 0.0)));
    for (int k = 0; k < 3; ++k) {
      if (g.integer(0, 1) == 0) theta(k) = 0.0;
    }
    Quat q = test::any_attitude(g);
    const Quat before = q;
    Vec3 p = g.normal_vector<3>(5.0);
    retract_pose(theta, Vec3::Zero(), q, p);
    ASSERT_TRUE(q.coeffs().allFinite() && p.allFinite());
    EXPECT_LT((so3_log(q * before.conjugate()) - theta).norm(), 1e-12);
  });
}

// One range between two images is used at one of them; the next image finds it gone.
TEST(Faults, F02ARangeIsUsedOnce) {
  sim::FlightSettings settings = test::quick_settings(true);
  settings.range_rate_hz = 5.0;
  Feed feed(test::lively_scene(4.0), settings);
  std::uint64_t given = 0;
  std::uint64_t on_facets = 0;
  std::uint64_t by_tracks = 0;
  feed.on_range = [&given](RangeSample&) {
    ++given;
    return true;
  };
  feed.after_frame = [&](Status) {
    const FrameReport& report = feed.estimator->report();
    on_facets += report.ranges_used;
    by_tracks += report.ranged_used + report.ranged_rejected;
    EXPECT_LE(on_facets + by_tracks, given);
  };
  feed.fly_until(4.0);
  EXPECT_GT(on_facets + by_tracks, 10U);
  EXPECT_EQ(on_facets, feed.estimator->counters().ranges_used);
  EXPECT_LE(by_tracks, feed.estimator->counters().ranges_feature);
}

// The size of the noise is divided out of each row before rows of different sensors meet: scaling a row and its sigma
// together changes nothing.
TEST(Faults, F07RowsAreWhitenedBeforeTheyAreMixed) {
  test::for_all(50, [](test::Generator& g) {
    const auto state = std::make_unique<FilterState<TinyConfig>>();
    test::fill_state(g, test::nadir_calibration(), 2, *state);
    FilterState<TinyConfig> other = *state;
    const test::Dense h = test::any_matrix(g, 4, state->size());
    const Vec3 unused = g.normal_vector<3>(1.0);
    const Eigen::Vector4d r(g.normal(1.0), unused.x(), unused.y(), unused.z());
    const auto update = [&](FilterState<TinyConfig>& s, double unit) {
      const auto stack = std::make_unique<UpdateStack<TinyConfig>>();
      stack->begin(s);
      MatrixView rows = stack->open(4);
      const Eigen::Vector4d sigma = unit * Eigen::Vector4d(0.01, 0.3, 2.0, 50.0);
      for (std::size_t k = 0; k < 4; ++k) {
        const Eigen::Index e = test::index(k);
        for (std::size_t c = 0; c < s.size(); ++c) rows(k, c) = unit * h(e, test::index(c)) / sigma(e);
        stack->residual(k) = unit * r(e) / sigma(e);
      }
      Support all;
      ASSERT_EQ(all.push_back({0, s.size()}), Status::kOk);
      stack->close_untested(s, all);
      ASSERT_EQ(stack->apply(s), Status::kOk);
    };
    update(*state, 1.0);
    update(other, 1024.0);  // millimetres for metres, so to say
    EXPECT_EQ(state->hash(), other.hash());
  });
}

// Two features in one place of the image are two features: the facet names vertices, and they are the right ones.
TEST(Faults, F18FeaturesThatShareAPixelKeepTheirIdentity) {
  test::for_all(200, [](test::Generator& g) {
    std::vector<Vec2> points = {Vec2(-0.3, -0.2), Vec2(0.3, -0.2), Vec2(0.0, 0.3)};
    const auto twin = static_cast<std::size_t>(g.integer(0, 2));
    const auto where = static_cast<std::ptrdiff_t>(g.integer(0, 3));
    points.insert(points.begin() + where, points[twin]);
    const Result<FacetChoice> facet = find_facet(points, Vec2(g.uniform(-0.05, 0.05), g.uniform(-0.1, 0.1)));
    ASSERT_TRUE(facet.has_value());
    std::vector<Vec2> corners;
    for (const std::size_t v : facet->vertices) corners.push_back(points[v]);
    for (const Vec2& corner : {Vec2(-0.3, -0.2), Vec2(0.3, -0.2), Vec2(0.0, 0.3)}) {
      EXPECT_NE(std::find(corners.begin(), corners.end(), corner), corners.end());
    }
  });
}

// An inverse depth that an update drives to zero or below is a point at infinity or beyond: it has an image like any
// other, and this goes through infinity without a jump.
TEST(Faults, F22AnInverseDepthBelowZeroDoesNoHarm) {
  test::for_all(200, [](test::Generator& g) {
    const CameraPose anchor = test::camera_seeing(g, Vec3::Zero());
    CameraPose camera = anchor;
    camera.p_WC_m += g.normal_vector<3>(0.3);
    const Vec2 z(g.uniform(-0.5, 0.5), g.uniform(-0.5, 0.5));
    const auto seen = [&](double rho) {
      VisualPrediction p;
      EXPECT_EQ(predict_feature(camera, anchor, {z.x(), z.y(), rho}, p), Status::kOk) << rho;
      EXPECT_TRUE(p.z.allFinite() && p.by_pose.allFinite() && p.by_feature.allFinite()) << rho;
      return p;
    };
    const double rho = std::pow(10.0, g.uniform(-9.0, -2.0));
    const VisualPrediction infinity = seen(0.0);
    const Vec2 slope = infinity.by_feature.col(2);
    const double curved = 20.0 * rho * rho + 1e-14;
    EXPECT_LT((seen(rho).z - infinity.z - rho * slope).norm(), curved);
    EXPECT_LT((seen(-rho).z - infinity.z + rho * slope).norm(), curved);
  });
}

/// A camera at the place of `camera`, half a turn about its x axis away: what the one sees, the other has behind it, at
/// a negative inverse depth.
CameraPose turned_away(CameraPose camera) {
  camera.R_WC = camera.R_WC * Vec3(1.0, -1.0, -1.0).asDiagonal();
  return camera;
}

// A point behind its anchor is none, even where the formula gives one that other cameras would see.
TEST(Faults, F22NothingBehindItsAnchorBecomesAPointOrAFacet) {
  test::for_all(200, [](test::Generator& g) {
    const Vec3 corners[] = {Vec3(-1.0, -1.0, g.normal(0.1)), Vec3(1.0, -1.0, g.normal(0.1)),
                            Vec3(0.0, 1.5, g.normal(0.1))};
    const CameraPose camera{Mat3(Vec3(1.0, -1.0, -1.0).asDiagonal()), Vec3(0.0, 0.0, g.uniform(2.0, 10.0))};
    const Beam beam{Vec3::Zero(), Vec3::UnitZ()};
    Facet facet;
    for (std::size_t j = 0; j < 3; ++j) {
      facet[j].anchor = test::camera_seeing(g, corners[j]);
      facet[j].feature = test::feature_of(facet[j].anchor, corners[j]);
    }
    RangePrediction range;
    ASSERT_EQ(predict_range(camera, beam, facet, range), Status::kOk);

    const auto j = static_cast<std::size_t>(g.integer(0, 2));
    Reanchoring r;
    ASSERT_EQ(reanchor_feature(facet[j].anchor, camera, facet[j].feature, r), Status::kOk);
    facet[j].anchor = turned_away(facet[j].anchor);
    facet[j].feature = test::feature_of(facet[j].anchor, corners[j]);
    ASSERT_LT(facet[j].feature.z(), 0.0);
    EXPECT_EQ(reanchor_feature(facet[j].anchor, camera, facet[j].feature, r), Status::kInvalidValue);
    EXPECT_EQ(predict_range(camera, beam, facet, range), Status::kInvalidValue);
  });
}

/// Flies both for three seconds. The second one processes images five at a time, and must stand where the first one
/// stood after as many.
void expect_same_after_batches_of_five(Feed& prompt, Feed& late) {
  std::vector<std::uint64_t> hashes;
  prompt.after_frame = [&](Status) { hashes.push_back(prompt.estimator->state_hash()); };
  prompt.fly_until(3.0);
  prompt.after_frame = [](Status) {};
  late.fly_until(3.0);
  const std::size_t processed = hashes.size() - hashes.size() % 5;
  ASSERT_GT(processed, 80U);
  EXPECT_EQ(late.estimator->state_hash(), hashes[processed - 1]);
}

// The result hangs on time stamps, not on when samples happen to be handed over.
TEST(Faults, F26WhenSamplesArriveDoesNotMatter) {
  const sim::Scene scene = test::lively_scene(3.0);
  Feed prompt(scene, test::quick_settings(true));
  Feed late(scene, test::quick_settings(true));
  // Images reach the second one five at a time, long after the IMU has gone on, ranges still in their order.
  std::vector<Time> held;
  std::vector<RangeSample> ranges;
  const auto release = [&] {
    for (const Time image : held) {
      while (!ranges.empty() && ranges.front().t <= image) {
        EXPECT_EQ(late.estimator->add_range(ranges.front()), Status::kOk);
        ranges.erase(ranges.begin());
      }
      late.process(image);
    }
    held.clear();
  };
  late.on_range = [&](RangeSample& sample) {
    if (sample.quality == RangeQuality::kValid) ranges.push_back(sample);
    return false;
  };
  late.on_image = [&](Time t) {
    held.push_back(t);
    if (held.size() == 5) release();
    return false;
  };
  expect_same_after_batches_of_five(prompt, late);
}

// Nor on how early: a range that is there before an older image is used with it is not yet known to that image.
TEST(Faults, F26ARangeThatComesEarlyDoesNotMatter) {
  const sim::Scene scene = test::lively_scene(3.0);
  Feed prompt(scene, test::quick_settings(true));
  Feed late(scene, test::quick_settings(true));
  std::vector<Time> held;  // the ranges go on meanwhile
  late.on_image = [&](Time t) {
    held.push_back(t);
    if (held.size() < 5) return false;
    for (const Time image : held) late.process(image);
    held.clear();
    return false;
  };
  expect_same_after_batches_of_five(prompt, late);
}

// Two images that both lie between the same two IMU samples see two different states.
TEST(Faults, F26TheStateIsThatOfTheImageTime) {
  sim::FlightSettings settings = test::quick_settings(false);
  settings.imu = sim::noise_free();
  settings.image_rate_hz = 33.3;  // every phase against the 250 Hz of the IMU
  const sim::Scene scene = test::lively_scene(2.0);
  Feed feed(scene, settings);
  feed.on_frame = [&](Feed::Frame& frame) {
    frame.observations.clear();  // inertial only: what is left is integration
    if (!feed.estimator->state().valid) {
      const sim::ImuModel unbiased(settings.imu, settings.imu_rate_hz, scene.gravity_m_s2, settings.seed);
      feed.estimator->start_from(sim::true_nav_state(scene.trajectory.at(seconds(frame.t)), unbiased, frame.t));
    }
    return true;
  };
  feed.after_frame = [&](Status) {
    EXPECT_LT(test::position_error(feed.estimator->state(), feed.truth()), 2e-4);
    EXPECT_LT((Vec3(feed.estimator->state().v_WI_m_s.data()) - feed.truth().v_WI_m_s).norm(), 5e-4);
  };
  feed.fly_until(1.0);
}

// Yaw has no sensor. The filter never claims to know it better than it did at the start, however long it looks at the
// ground; without the invariant error it would within seconds.
TEST(Faults, F30HeadingIsNeverLearnt) {
  Feed feed(test::lively_scene(6.0), test::quick_settings(true));
  const auto heading_sigma = [&feed] {
    const NavState& s = feed.estimator->state();
    const Quat q(s.q_WI[0], s.q_WI[1], s.q_WI[2], s.q_WI[3]);
    const Eigen::Map<const Mat15> p(s.covariance.data());
    const Mat3 local = p.block<3, 3>(static_cast<Eigen::Index>(kNavAttitude), static_cast<Eigen::Index>(kNavAttitude));
    return std::sqrt((q.toRotationMatrix() * local * q.toRotationMatrix().transpose())(2, 2));
  };
  double before = 0.0;
  feed.after_frame = [&](Status) {
    if (seconds(feed.estimator->state().t) < 0.1) return;
    const double now = heading_sigma();
    EXPECT_GT(now, before * 0.999);  // it may only grow, by the gyro's noise
    before = std::max(before, now);
  };
  feed.fly_until(6.0);
  EXPECT_GT(before, 0.0);
}

}  // namespace
}  // namespace plumb
