#include "fsw/vision/flight_tracker.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <memory>
#include <set>
#include <vector>

#include "test/unit/vision/painted_scene.h"

namespace plumb {
namespace {

using test::Picture;
using test::View;

constexpr std::size_t kMaxTracks = FlightConfig::kMaxTracks;
using TestTracker = FlightTracker<FlightConfig>;
using Frame = FeatureFrame<kMaxTracks>;

constexpr std::int64_t kInterval_ns = 50'000'000;

TrackerOptions small_options() {
  TrackerOptions options;
  options.max_features = 60;
  options.tile_columns = 4;
  options.tile_rows = 3;
  return options;
}

class FlightTrackerTest : public ::testing::Test {
 protected:
  std::unique_ptr<TestTracker> make() const {
    return std::make_unique<TestTracker>(test::small_lens(), small_options());
  }
  static CameraFrame frame(const Picture& picture, int index) {
    return {Time::from_ns(1'000'000'000 + index * kInterval_ns), static_cast<std::uint32_t>(index), picture.view};
  }
  static MotionPrediction motion(const View& previous, const View& now) {
    return {true, now.q_WC.conjugate() * previous.q_WC};
  }

  CameraModel camera_{test::small_lens()};
};

struct Flight {
  std::vector<View> views;
  std::vector<Picture> pictures;
};

/// A hand-held flight along the wall: turning about all axes, moving sideways and towards it, fading light.
Flight make_flight(const CameraModel& camera, int count) {
  test::Generator g(test::base_seed());
  const test::PaintedWall wall(g);
  Flight flight;
  for (int i = 0; i < count; ++i) {
    View view;
    view.q_WC = so3_exp(Vec3(0.01 * i, -0.008 * i, 0.02 * i));
    view.p_WC = Vec3(0.012 * i, 0.006 * i, 0.01 * i);
    flight.views.push_back(view);
    flight.pictures.push_back(paint(wall, camera, view, 1.0 - 0.02 * i));
  }
  return flight;
}

TEST_F(FlightTrackerTest, FollowsToATenthOfAPixelUnderLastingIds) {
  constexpr int kFrames = 8;
  const Flight flight = make_flight(camera_, kFrames);
  const auto tracker = make();
  std::map<std::uint32_t, Vec2> born;  // the point of the wall that each track was first seen at
  std::uint32_t newest = 0;
  std::size_t checked = 0;
  std::size_t exact = 0;
  for (int i = 0; i < kFrames; ++i) {
    const MotionPrediction prediction = i == 0 ? MotionPrediction{} : motion(flight.views[i - 1], flight.views[i]);
    Frame out;
    ASSERT_EQ(tracker->track(frame(flight.pictures[i], i), prediction, out), Status::kOk);
    EXPECT_EQ(out.sequence, static_cast<std::uint32_t>(i));
    EXPECT_EQ(out.t, frame(flight.pictures[i], i).t_exposure_mid);
    EXPECT_GT(out.observations.size(), 30U);
    EXPECT_LE(out.observations.size(), 60U);
    for (std::size_t k = 0; k < out.observations.size(); ++k) {
      const FeatureObservation& seen = out.observations[k];
      if (k > 0) {
        EXPECT_GT(seen.track_id, out.observations[k - 1].track_id);
      }
      Vec2 pixel;
      ASSERT_EQ(camera_.distort(Vec2(seen.x, seen.y), pixel), Status::kOk);
      EXPECT_NEAR(pixel.x(), static_cast<double>(seen.u_px), 1e-4);
      EXPECT_NEAR(pixel.y(), static_cast<double>(seen.v_px), 1e-4);
      const auto [first, is_new] = born.try_emplace(seen.track_id, on_wall(flight.views[i], Vec2(seen.x, seen.y)));
      if (is_new) {
        if (i > 0) {
          EXPECT_GE(seen.track_id, newest);
        }
        newest = seen.track_id;
        continue;
      }
      Vec2 truth;
      ASSERT_EQ(camera_.distort(seen_at(flight.views[i], first->second), truth), Status::kOk);
      ++checked;
      if ((truth - pixel).norm() < 0.1) ++exact;
      EXPECT_LT((truth - pixel).norm(), 0.5) << "frame " << i << " track " << seen.track_id;
    }
  }
  EXPECT_GT(checked, 150U);
  EXPECT_GT(static_cast<double>(exact), 0.95 * static_cast<double>(checked));
}

TEST_F(FlightTrackerTest, StandingStillItDoesNotDrift) {
  const Flight flight = make_flight(camera_, 1);
  const auto tracker = make();
  Frame first;
  ASSERT_EQ(tracker->track(frame(flight.pictures[0], 0), {}, first), Status::kOk);
  Frame last;
  for (int i = 1; i < 30; ++i) {
    // A gyro bias of 0.08 rad/s that nobody knows yet.
    const MotionPrediction biased{true, so3_exp(Vec3(0.0, 0.0, 0.004))};
    ASSERT_EQ(tracker->track(frame(flight.pictures[0], i), biased, last), Status::kOk);
  }
  ASSERT_GE(last.observations.size(), first.observations.size());
  for (std::size_t i = 0; i < first.observations.size(); ++i) {
    EXPECT_EQ(last.observations[i].track_id, first.observations[i].track_id);
    EXPECT_NEAR(last.observations[i].u_px, first.observations[i].u_px, 0.05F);
    EXPECT_NEAR(last.observations[i].v_px, first.observations[i].v_px, 0.05F);
  }
}

// From image to image all looks alike, but it is another wall in the end: a track that went on would have slid.
TEST_F(FlightTrackerTest, ATrackEndsBeforeWhatItSeesBecomesAnother) {
  constexpr int kFrames = 30;
  test::Generator g(test::base_seed());
  const Picture from = paint(test::PaintedWall(g), camera_, {});
  const Picture to = paint(test::PaintedWall(g), camera_, {});
  const auto tracker = make();
  Frame out;
  std::uint32_t newest_at_first = 0;
  for (int i = 0; i <= kFrames; ++i) {
    Picture between = from;
    for (std::size_t k = 0; k < between.pixels.size(); ++k) {
      between.pixels[k] = static_cast<std::uint8_t>((from.pixels[k] * (kFrames - i) + to.pixels[k] * i) / kFrames);
    }
    between.view.pixels = between.pixels.data();
    ASSERT_EQ(tracker->track(frame(between, i), {}, out), Status::kOk);
    ASSERT_GT(out.observations.size(), 20U) << "others take their places";
    if (i == 0) newest_at_first = out.observations.back().track_id;
  }
  const auto went_on = std::count_if(out.observations.begin(), out.observations.end(),
                                     [&](const FeatureObservation& seen) { return seen.track_id <= newest_at_first; });
  EXPECT_LT(5 * went_on, newest_at_first) << "most must end; a hill may resemble a hill";
}

TEST_F(FlightTrackerTest, WorksWithoutPrediction) {
  const Flight flight = make_flight(camera_, 4);
  const auto tracker = make();
  Frame out;
  for (int i = 0; i < 4; ++i) {
    ASSERT_EQ(tracker->track(frame(flight.pictures[i], i), {}, out), Status::kOk);
    if (i > 0) {
      EXPECT_GT(tracker->report().before - tracker->report().lost_outlier, 20U);
    }
  }
}

TEST_F(FlightTrackerTest, APredictionThatIsNotANumberIsNoPrediction) {
  const Flight flight = make_flight(camera_, 2);
  const auto tracker = make();
  Frame out;
  ASSERT_EQ(tracker->track(frame(flight.pictures[0], 0), {}, out), Status::kOk);
  const MotionPrediction bad{true, Quat(std::nan(""), 0.0, 0.0, 0.0)};
  ASSERT_EQ(tracker->track(frame(flight.pictures[1], 1), bad, out), Status::kOk);
  EXPECT_GT(out.observations.size(), 30U);
}

TEST_F(FlightTrackerTest, SpreadsFeaturesOverTheImage) {
  const Flight flight = make_flight(camera_, 1);
  const auto tracker = make();
  Frame out;
  ASSERT_EQ(tracker->track(frame(flight.pictures[0], 0), {}, out), Status::kOk);
  TileGrid<12> tiles(320, 240, 4, 3, small_options().border_px + 1);
  for (const FeatureObservation& seen : out.observations) tiles.add(seen.u_px, seen.v_px);
  for (std::size_t tile = 0; tile < tiles.size(); ++tile) {
    EXPECT_GE(tiles.count(tile), 2);
    EXPECT_LE(tiles.count(tile), 5);
  }
  for (const FeatureObservation& a : out.observations) {
    for (const FeatureObservation& b : out.observations) {
      if (a.track_id == b.track_id) continue;
      EXPECT_GT(std::hypot(a.u_px - b.u_px, a.v_px - b.v_px), static_cast<float>(small_options().min_distance_px - 4));
    }
  }
}

// Every tile of this wall has corners, so that each that is searched gives a track, and the search ends with the last.
TEST_F(FlightTrackerTest, SearchesNoMoreTilesThanItNeeds) {
  TrackerOptions options = small_options();
  options.max_features = 30;  // 2.5 a tile
  const Flight flight = make_flight(camera_, 8);
  const auto tracker = std::make_unique<TestTracker>(test::small_lens(), options);
  std::uint32_t started = 0;
  for (int i = 0; i < 8; ++i) {
    const MotionPrediction prediction = i == 0 ? MotionPrediction{} : motion(flight.views[i - 1], flight.views[i]);
    Frame out;
    ASSERT_EQ(tracker->track(frame(flight.pictures[i], i), prediction, out), Status::kOk);
    EXPECT_EQ(out.observations.size(), 30U);
    EXPECT_LE(tracker->report().searched_tiles, tracker->report().started);
    started += tracker->report().started;
  }
  EXPECT_GT(started, 30U) << "no track was lost, nothing was tried";
}

// Exactly there, without snapping to a corner, and followed as well as any other; not beside a track that is there
// already, outside the image, or where there is nothing to hold on to.
TEST_F(FlightTrackerTest, StartsAFeatureWhereItIsWanted) {
  const Flight flight = make_flight(camera_, 4);
  const auto tracker = make();
  Frame out;
  ASSERT_EQ(tracker->track(frame(flight.pictures[0], 0), {}, out), Status::kOk);
  const std::uint32_t before = out.observations.back().track_id;
  MotionPrediction wanting = motion(flight.views[0], flight.views[1]);
  const Vec2 here(0.0123, -0.0456);
  for (const Vec2& z : {here, here, Vec2(50.0, 0.0)}) static_cast<void>(wanting.wanted.push_back(z));
  ASSERT_EQ(tracker->track(frame(flight.pictures[1], 1), wanting, out), Status::kOk);
  ASSERT_EQ(tracker->report().started_wanted, 1U);
  std::uint32_t id = 0;
  for (const auto& seen : out.observations) {
    if (seen.track_id > before && (Vec2(seen.x, seen.y) - here).norm() < 1e-5) id = seen.track_id;
  }
  ASSERT_NE(id, 0U);
  const auto followed = [&](int i) {
    EXPECT_EQ(tracker->track(frame(flight.pictures[i], i), motion(flight.views[i - 1], flight.views[i]), out),
              Status::kOk);
    return std::any_of(out.observations.begin(), out.observations.end(),
                       [id](const auto& seen) { return seen.track_id == id; });
  };
  EXPECT_TRUE(followed(2));
  EXPECT_TRUE(followed(3));
}

TEST_F(FlightTrackerTest, AWantedFeatureNeedsTexture) {
  const auto tracker = make();
  std::vector<std::uint8_t> grey(static_cast<std::size_t>(test::small_lens().width * test::small_lens().height), 90);
  const ImageView blank{grey.data(), test::small_lens().width, test::small_lens().height, test::small_lens().width};
  MotionPrediction wanting;
  static_cast<void>(wanting.wanted.push_back(Vec2(0.01, 0.01)));
  Frame out;
  ASSERT_EQ(tracker->track({Time::from_ns(1'000'000'000), 0, blank}, wanting, out), Status::kOk);
  EXPECT_TRUE(out.observations.empty());
}

TEST_F(FlightTrackerTest, RefusesMalformedAndLateFramesAndKeepsItsState) {
  const Flight flight = make_flight(camera_, 2);
  const auto tracker = make();
  Frame out;
  ASSERT_EQ(tracker->track(frame(flight.pictures[0], 5), {}, out), Status::kOk);
  const std::size_t tracked = out.observations.size();
  const auto refused = [&](CameraFrame bad, Status expected) {
    EXPECT_EQ(tracker->track(bad, {}, out), expected);
    EXPECT_EQ(out.observations.size(), tracked);
  };
  refused(frame(flight.pictures[1], 5), Status::kOutOfOrder);
  refused(frame(flight.pictures[1], 4), Status::kOutOfOrder);
  CameraFrame bad = frame(flight.pictures[1], 6);
  bad.image.pixels = nullptr;
  refused(bad, Status::kInvalidValue);
  bad = frame(flight.pictures[1], 6);
  bad.image.width = 319;
  refused(bad, Status::kInvalidValue);
  bad = frame(flight.pictures[1], 6);
  bad.image.stride = 319;
  refused(bad, Status::kInvalidValue);
  bad = frame(flight.pictures[1], 6);
  bad.t_exposure_mid = Time::never();
  refused(bad, Status::kInvalidValue);

  const auto undisturbed = make();
  Frame expected;
  ASSERT_EQ(undisturbed->track(frame(flight.pictures[0], 5), {}, expected), Status::kOk);
  ASSERT_EQ(undisturbed->track(frame(flight.pictures[1], 6), {}, expected), Status::kOk);
  ASSERT_EQ(tracker->track(frame(flight.pictures[1], 6), {}, out), Status::kOk);
  ASSERT_EQ(out.observations.size(), expected.observations.size());
  for (std::size_t i = 0; i < out.observations.size(); ++i) {
    EXPECT_EQ(out.observations[i].u_px, expected.observations[i].u_px);
  }
}

TEST_F(FlightTrackerTest, AnImageWithoutTextureGivesNothingAndEndsTheTracks) {
  const Flight flight = make_flight(camera_, 1);
  const std::vector<std::uint8_t> grey(320 * 240, 90);
  Picture blank;
  blank.pixels = grey;
  blank.view = {blank.pixels.data(), 320, 240, 320};
  const auto tracker = make();
  Frame out;
  ASSERT_EQ(tracker->track(frame(blank, 0), {}, out), Status::kOk);
  EXPECT_TRUE(out.observations.empty());
  ASSERT_EQ(tracker->track(frame(flight.pictures[0], 1), {}, out), Status::kOk);
  EXPECT_GT(out.observations.size(), 30U);
  const std::uint32_t newest = out.observations.back().track_id;
  ASSERT_EQ(tracker->track(frame(blank, 2), {}, out), Status::kOk);
  EXPECT_TRUE(out.observations.empty());
  ASSERT_EQ(tracker->track(frame(flight.pictures[0], 3), {}, out), Status::kOk);
  ASSERT_FALSE(out.observations.empty());
  EXPECT_GT(out.observations.front().track_id, newest);
}

TEST_F(FlightTrackerTest, ResetForgetsTheTracksButNeverReusesAnId) {
  const Flight flight = make_flight(camera_, 2);
  const auto tracker = make();
  Frame before;
  ASSERT_EQ(tracker->track(frame(flight.pictures[0], 7), {}, before), Status::kOk);
  tracker->reset();
  Frame after;
  ASSERT_EQ(tracker->track(frame(flight.pictures[0], 0), {}, after), Status::kOk);  // time may start again
  ASSERT_EQ(after.observations.size(), before.observations.size());
  EXPECT_GT(after.observations.front().track_id, before.observations.back().track_id);
}

TEST_F(FlightTrackerTest, SameFramesSameBits) {
  constexpr int kFrames = 6;
  const Flight flight = make_flight(camera_, kFrames);
  const auto first = make();
  const auto second = make();
  for (int i = 0; i < kFrames; ++i) {
    const MotionPrediction prediction = i == 0 ? MotionPrediction{} : motion(flight.views[i - 1], flight.views[i]);
    Frame a;
    Frame b;
    ASSERT_EQ(first->track(frame(flight.pictures[i], i), prediction, a), Status::kOk);
    ASSERT_EQ(second->track(frame(flight.pictures[i], i), prediction, b), Status::kOk);
    ASSERT_EQ(a.observations.size(), b.observations.size());
    for (std::size_t k = 0; k < a.observations.size(); ++k) {
      EXPECT_EQ(a.observations[k].track_id, b.observations[k].track_id);
      EXPECT_EQ(std::memcmp(&a.observations[k].u_px, &b.observations[k].u_px, sizeof(float)), 0);
      EXPECT_EQ(std::memcmp(&a.observations[k].v_px, &b.observations[k].v_px, sizeof(float)), 0);
      EXPECT_EQ(std::memcmp(&a.observations[k].x, &b.observations[k].x, sizeof(double)), 0);
      EXPECT_EQ(std::memcmp(&a.observations[k].y, &b.observations[k].y, sizeof(double)), 0);
    }
  }
}

}  // namespace
}  // namespace plumb
