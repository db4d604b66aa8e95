// What takes other options over must come to the same as what was made with them, wherever it keeps a copy or a value
// that follows from them; and to take the same ones over again must change no bit, because once a second everything
// gets its options anew.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <vector>

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
using Hashes = std::vector<std::uint64_t>;

/// Every parameter that may change, within a factor of two of its default.
Parameters others(test::Generator& g) {
  Parameters parameters;
  for (;;) {
    for (const ParamRow<Parameters>& row : parameter_table().rows()) {
      if (row.change == ParamChange::kNever || row.kind == ParamKind::kBoolean) continue;
      double value = row.default_value * std::exp2(g.uniform(-1.0, 1.0));
      if (row.kind == ParamKind::kInteger) value = std::round(value);
      if (row.name == "vision.gate_probability" || row.name == "direction.gate_probability")
        value = g.uniform(0.9, 0.999);
      EXPECT_EQ(parameter_table().set(parameters, row.name, std::clamp(value, row.min, row.max)).status, Status::kOk);
    }
    if (conflicts_in(parameters).empty()) return parameters;
  }
}

/// The hash of the state at every image of a flight with a start in motion. `between` is called after each.
Hashes fly(
    const EstimatorOptions& made_with, const EstimatorOptions* uses,
    const std::function<void(Estimator<FlightConfig>&)>& between = [](auto&) {}) {
  static const sim::Scene scene = test::lively_scene(3.0);
  sim::FlightSettings settings = test::quick_settings(false);
  settings.image_rate_hz = 15.0;
  Feed feed(scene, settings);
  feed.estimator = std::make_unique<Estimator<FlightConfig>>(made_with, scene.rig.calibration());
  if (uses != nullptr) feed.estimator->use(*uses);
  Hashes hashes;
  feed.after_frame = [&](Status) {
    hashes.push_back(feed.estimator->state_hash());
    between(*feed.estimator);
  };
  feed.fly_until(3.0);
  return hashes;
}

TEST(ParametersInFlightLaws, AnEstimatorThatTakesThemOverIsAsOneMadeWithThem) {
  const Hashes with_defaults = fly({}, nullptr);
  test::for_all(6, [&with_defaults](test::Generator& g) {
    const EstimatorOptions options = others(g).estimator;
    const Hashes made = fly(options, nullptr);
    EXPECT_EQ(fly({}, &options), made);
    EXPECT_NE(made, with_defaults);
  });
}

TEST(ParametersInFlightLaws, TakingTheSameOverAgainChangesNoBitOfTheEstimate) {
  test::for_all(3, [](test::Generator& g) {
    EstimatorOptions options = others(g).estimator;
    options.vision.pixel_noise_images = static_cast<int>(g.integer(0, 1)) * 5;  // noise that follows goes on
    options.vision.pixel_noise_px = 2.0 * options.vision.pixel_noise_max_px;
    EXPECT_EQ(fly(options, nullptr, [&options](Estimator<FlightConfig>& estimator) { estimator.use(options); }),
              fly(options, nullptr));
  });
}

// In the middle of the flight: the state goes on, and what follows is another.
TEST(ParametersInFlightLaws, AChangeCountsFromTheNextImageOn) {
  constexpr std::size_t kChanged = 30;
  EstimatorOptions noisier;
  noisier.vision.pixel_noise_px *= 2.0;
  std::size_t images = 0;
  const Hashes before = fly({}, nullptr);
  const Hashes hashes = fly({}, nullptr, [&](Estimator<FlightConfig>& estimator) {
    if (++images == kChanged) estimator.use(noisier);
  });
  ASSERT_GT(hashes.size(), kChanged + 2);
  EXPECT_TRUE(std::equal(hashes.begin(), hashes.begin() + kChanged, before.begin()));
  EXPECT_NE(hashes[kChanged], before[kChanged]);
}

/// A wall that passes by.
std::vector<test::Picture> pictures() {
  test::Generator g(test::base_seed());
  const test::PaintedWall wall(g);
  std::vector<test::Picture> pictures;
  for (int i = 0; i < 6; ++i) {
    test::View view;
    view.p_WC = Vec3(0.06 * i, 0.0, 0.03 * i);
    pictures.push_back(paint(wall, CameraModel(test::small_lens()), view));
  }
  return pictures;
}

/// What a tracker sees of it. `again`: it takes over what it was made with after each image.
Hashes track(const TrackerOptions& made_with, const TrackerOptions* uses, bool again = false) {
  static const std::vector<test::Picture> seen = pictures();
  const auto tracker = std::make_unique<FlightTracker<FlightConfig>>(test::small_lens(), made_with);
  if (uses != nullptr) tracker->use(*uses);
  FeatureFrame<FlightConfig::kMaxTracks> out;
  Hashes hashes;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const CameraFrame frame{Time::from_ns(1 + 50'000'000LL * static_cast<std::int64_t>(i)),
                            static_cast<std::uint32_t>(i), seen[i].view};
    EXPECT_EQ(tracker->track(frame, MotionPrediction{}, out), Status::kOk);
    Hash64 hash;
    for (const FeatureObservation& feature : out.observations) {
      hash.add(std::uint64_t{feature.track_id});
      hash.add(feature.x);
      hash.add(feature.y);
    }
    hashes.push_back(hash.value());
    if (again) tracker->use(made_with);
  }
  return hashes;
}

TEST(ParametersInFlightLaws, ATrackerThatTakesThemOverIsAsOneMadeWithThem) {
  int different = 0;
  test::for_all(12, [&different](test::Generator& g) {
    const TrackerOptions options = others(g).tracker;
    const Hashes made = track(options, nullptr);
    EXPECT_EQ(track({}, &options), made);
    EXPECT_EQ(track(options, nullptr, true), made) << "taken over again";
    different += made != track({}, nullptr) ? 1 : 0;
  });
  EXPECT_GT(different, 6);
}

// What would lay a tracker out anew is left alone.
TEST(ParametersInFlight, ATrackerKeepsWhatItWasLaidOutBy) {
  for (const ParamRow<Parameters>& row : parameter_table().rows()) {
    if (!row.name.starts_with("tracker.") || row.change != ParamChange::kNever) continue;
    Parameters parameters;
    row.set(parameters, row.min);
    EXPECT_EQ(track({}, &parameters.tracker), track({}, nullptr)) << row.name;
  }
}

TEST(ParametersInFlightLaws, AMonitorThatTakesThemOverIsAsOneMadeWithThem) {
  test::for_all(20, [](test::Generator& g) {
    const ModeOptions options = others(g).modes;
    FlightMonitor made(options);
    FlightMonitor uses({});
    uses.use(options);
    NavResult result;
    InputFrame input;
    for (int i = 0; i < 2000; ++i) {
      input.t = Time::from_ns(1 + 20'000'000LL * i);
      const bool good = g.integer(0, 20) > 0 && i / 200 % 2 == 0;
      result.state = {.t = input.t, .valid = i % 900 > 100, .t_vision = good ? input.t : Time::never()};
      if (i % 150 == 0) ++result.estimator.resets;
      input.has_camera = i % 3 == 0;
      for (FlightMonitor* monitor : {&made, &uses}) {
        monitor->take(result);
        monitor->step(input, {.imu = {.samples = 1, .accepted = good ? 1U : 0U, .refused = good ? 0U : 1U},
                              .t_imu = good ? input.t : Time::never(),
                              .state = result.state});
      }
      ASSERT_EQ(made.mode(), uses.mode());
      for (std::size_t k = 0; k < kSensorNames.size(); ++k) {
        ASSERT_EQ(made.sensors()[k].state, uses.sensors()[k].state);
      }
    }
  });
}

}  // namespace
}  // namespace plumb
