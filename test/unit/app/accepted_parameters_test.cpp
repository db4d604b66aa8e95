// A parameter file is an input like any other: whatever values are accepted, alone at the ends of their ranges or all
// at random, nothing in the flight software may take them for a bug, and no state may hold what is not a number. A
// broken assertion ends this program.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "fsw/app/flight_monitor.h"
#include "fsw/app/parameters.h"
#include "fsw/base/mission_config.h"
#include "fsw/vision/flight_tracker.h"
#include "test/support/estimator_feed.h"
#include "test/support/property.h"
#include "test/unit/vision/painted_scene.h"

namespace plumb {
namespace {

using Feed = test::EstimatorFeed<Estimator<FlightConfig>>;

/// A flight through every part of the estimator: start in motion, updates with and without range.
void fly(const EstimatorOptions& options) {
  static const sim::Scene scene = test::lively_scene(3.0);
  sim::FlightSettings settings = test::quick_settings(false);
  settings.image_rate_hz = 15.0;
  Feed feed(scene, settings);
  feed.estimator = std::make_unique<Estimator<FlightConfig>>(options, scene.rig.calibration());
  feed.after_frame = [&feed](Status) {
    const NavState& state = feed.estimator->state();
    EXPECT_TRUE(!state.valid || test::all_finite(state));
  };
  feed.fly_until(3.0);
}

/// The same for the tracker, on a wall that passes by. False when the options were refused.
bool track(const TrackerOptions& options) {
  const CameraCalibration lens = test::small_lens();
  if (!ok(TrackerOptions::check(options, lens, FlightConfig::kMaxTracks))) return false;
  test::Generator g(test::base_seed());
  const test::PaintedWall wall(g);
  const CameraModel camera(lens);
  const auto tracker = std::make_unique<FlightTracker<FlightConfig>>(lens, options);
  FeatureFrame<FlightConfig::kMaxTracks> out;
  for (int i = 0; i < 3; ++i) {
    test::View view;
    view.p_WC = Vec3(0.02 * i, 0.0, 0.01 * i);
    const test::Picture picture = paint(wall, camera, view);
    const CameraFrame frame{Time::from_ns(1 + 50'000'000LL * i), static_cast<std::uint32_t>(i), picture.view};
    EXPECT_EQ(tracker->track(frame, MotionPrediction{}, out), Status::kOk);
    EXPECT_LE(out.observations.size(), static_cast<std::size_t>(options.max_features));
  }
  return true;
}

/// The same for modes and health, on samples and results of every kind.
void watch(const ModeOptions& options) {
  FlightMonitor monitor(options);
  NavResult result;
  InputFrame input;
  for (int i = 0; i < 3000; ++i) {
    input.t = Time::from_ns(1 + 10'000'000LL * i);
    const bool good = i / 300 % 2 == 0;
    result.state = {.t = input.t, .valid = i % 900 > 100, .t_vision = good ? input.t : Time::never()};
    if (i % 50 == 0) ++result.estimator.resets;
    result.reliable_for_s = time_to_unreliable_s(result.state, {}, options);
    EXPECT_TRUE(result.reliable_for_s >= 0.0 && result.reliable_for_s <= options.horizon_s);
    monitor.take(result);
    monitor.step(input, {.imu = {.samples = 1, .accepted = good ? 1U : 0U, .refused = good ? 0U : 1U},
                         .t_imu = input.t,
                         .state = result.state});
  }
}

/// False when the values were refused as a whole.
bool use(const Parameters& parameters, std::string_view name) {
  if (name.starts_with("tracker.")) return track(parameters.tracker);
  if (name.starts_with("modes.")) {
    watch(parameters.modes);
    return true;
  }
  if (!conflicts_in(parameters).empty()) return false;
  fly(parameters.estimator);
  return true;
}

/// Sets a third of all parameters to any value of their ranges.
void draw(test::Generator& g, Parameters& parameters) {
  for (const ParamRow<Parameters>& row : parameter_table().rows()) {
    const double share = g.uniform(0.0, 1.0);
    double value = row.min > 0.0 ? row.min * std::pow(row.max / row.min, share) : row.min + share * (row.max - row.min);
    if (row.kind != ParamKind::kReal) value = std::round(value);
    if (g.integer(0, 2) > 0) value = row.default_value;
    ASSERT_EQ(parameter_table().set(parameters, row.name, std::clamp(value, row.min, row.max)).status, Status::kOk);
  }
}

TEST(AcceptedParameters, EachAtTheEndsOfItsRangeIsFlown) {
  for (const ParamRow<Parameters>& row : parameter_table().rows()) {
    for (const double value : {row.min, row.max}) {
      SCOPED_TRACE(std::string(row.name) + " = " + std::to_string(value));
      Parameters parameters;
      ASSERT_EQ(parameter_table().set(parameters, row.name, value).status, Status::kOk);
      use(parameters, row.name);
    }
  }
}

TEST(AcceptedParameters, AllAtOneEndOfTheirRangesAreFlown) {
  for (const bool top : {false, true}) {
    SCOPED_TRACE(top);
    Parameters parameters;
    for (const ParamRow<Parameters>& row : parameter_table().rows()) {
      ASSERT_EQ(parameter_table().set(parameters, row.name, top ? row.max : row.min).status, Status::kOk);
    }
    parameters.estimator.range.facet_after_s = 0.5 * parameters.modes.range_timeout_s;  // has to be below it
    parameters.tracker.tile_rows = 1;  // there are at most as many tiles as columns can be
    EXPECT_TRUE(use(parameters, ""));
    EXPECT_TRUE(use(parameters, "modes."));
  }
}

TEST(AcceptedParameters, AnyTogetherAreFlown) {
  int used = 0;
  test::for_all(80, [&used](test::Generator& g) {
    Parameters parameters;
    const char* part = std::array{"", "tracker.", "modes."}[static_cast<std::size_t>(g.integer(0, 2))];
    ASSERT_NO_FATAL_FAILURE(draw(g, parameters));
    used += use(parameters, part) ? 1 : 0;
  });
  EXPECT_GT(used, 20);
}

// conflicts_in() and has_room() are told to the user, TrackerOptions::check() is what the tracker asserts: nothing may
// fall between them.
TEST(AcceptedParameters, ATrackerOfFittingPartsWithRoomIsTaken) {
  const CameraCalibration lens = test::small_lens();
  int taken = 0;
  test::for_all(2000, [&](test::Generator& g) {
    Parameters parameters;
    ASSERT_NO_FATAL_FAILURE(draw(g, parameters));
    if (!conflicts_in(parameters).empty() || !TrackerOptions::has_room(parameters.tracker, lens)) return;
    EXPECT_EQ(TrackerOptions::check(parameters.tracker, lens, FlightConfig::kMaxTracks), Status::kOk);
    ++taken;
  });
  EXPECT_GT(taken, 20);
}

}  // namespace
}  // namespace plumb
