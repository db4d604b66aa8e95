// Laws of the auto-exposure, over random scenes: it stays within its limits, moves one way only, and is done after a
// number of steps that the scene's range of light bounds.

#include "drivers/ov7251/auto_exposure.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "test/support/property.h"

namespace plumb::ov7251 {
namespace {

using test::Generator;

/// What pixels see: the part of their range that one second of light fills. They clip when they are full.
struct Scene {
  std::vector<double> fill_per_s;
  double mean(const Exposure& exposure) const {
    constexpr double kFull = 255.0;
    double sum = 0.0;
    for (const double fill : fill_per_s) sum += std::min(kFull, kFull * fill * light_s(exposure));
    return sum / static_cast<double>(fill_per_s.size());
  }
};

// From night to noon, and from flat to the sun in the picture.
Scene random_scene(Generator& g) {
  Scene scene;
  const double middle = std::pow(10.0, g.uniform(-1.0, 4.5));
  const double spread = g.uniform(0.0, 3.0);
  constexpr int kPixels = 200;
  for (int i = 0; i < kPixels; ++i) scene.fill_per_s.push_back(middle * std::exp(spread * g.normal(1.0)));
  return scene;
}

ExposureLimits random_limits(Generator& g) {
  const auto lines = static_cast<std::int64_t>(g.uniform(2.0, 1704.0));
  return {.line_time = kLineTime, .longest = kLineTime * lines, .max_gain = kMaxGain};
}

struct Adjustment {
  std::vector<Exposure> exposures;  ///< first to last
  bool settled = false;
  bool at_limit = false;
};

constexpr int kMaxUpdates = 400;

Adjustment adjust(AutoExposure& control, const Scene& scene, Exposure exposure) {
  Adjustment done;
  done.exposures.push_back(exposure);
  for (int i = 0; i < kMaxUpdates; ++i) {
    const Exposure next = control.update(scene.mean(exposure), exposure);
    done.at_limit = control.at_limit();
    done.settled = !control.adjusting();
    if (next == exposure) return done;
    exposure = next;
    done.exposures.push_back(exposure);
  }
  return done;
}

bool within(double mean, double target, double band) { return mean < target * band && mean > target / band; }

TEST(AutoExposureLaw, EndsRightOrAtALimitForAnyScene) {
  test::for_all(2000, [](Generator& g) {
    const Scene scene = random_scene(g);
    const ExposureLimits limits = random_limits(g);
    const AutoExposureOptions options{.target = g.uniform(kMinTarget, kMaxTarget),
                                      .max_gain = g.uniform(kLeastMaxGain, kMaxGain)};
    AutoExposure control(options, limits);
    const Exposure first = expose(g.uniform(1e-6, 0.1), limits);
    const Adjustment done = adjust(control, scene, first);
    const Exposure& last = done.exposures.back();
    const double mean = scene.mean(last);
    if (done.settled) {
      ASSERT_TRUE(within(mean, options.target, kBand)) << mean << " for " << options.target;
    } else {
      ASSERT_TRUE(done.at_limit);
      const Exposure least = expose(0.0, limits);
      const bool darkest = last == least && mean > options.target;
      const bool brightest = last.time + limits.line_time > limits.longest && mean < options.target &&
                             last.gain > options.max_gain - kGainStep;
      ASSERT_TRUE(darkest || brightest) << mean << " for " << options.target << " at gain " << last.gain;
    }
  });
}

TEST(AutoExposureLaw, NeverTurnsBack) {
  test::for_all(2000, [](Generator& g) {
    const Scene scene = random_scene(g);
    const ExposureLimits limits = random_limits(g);
    AutoExposure control({.target = g.uniform(kMinTarget, kMaxTarget)}, limits);
    const Adjustment done = adjust(control, scene, expose(g.uniform(1e-6, 0.1), limits));
    const auto& exposures = done.exposures;
    const bool up = exposures.size() > 1 && light_s(exposures[1]) > light_s(exposures[0]);
    for (std::size_t i = 1; i < exposures.size(); ++i) {
      ASSERT_EQ(light_s(exposures[i]) > light_s(exposures[i - 1]), up) << "at step " << i << " of " << exposures.size();
    }
  });
}

TEST(AutoExposureLaw, StaysInBoundsWithStepsThatTheTrackerBears) {
  test::for_all(1000, [](Generator& g) {
    const Scene scene = random_scene(g);
    const ExposureLimits limits = random_limits(g);
    const AutoExposureOptions options{.max_gain = g.uniform(kLeastMaxGain, kMaxGain)};
    AutoExposure control(options, limits);
    const Adjustment done = adjust(control, scene, expose(g.uniform(1e-6, 0.1), limits));
    constexpr double kRounding = 1.04;  // a sixteenth of gain, to the nearest
    for (std::size_t i = 1; i < done.exposures.size(); ++i) {
      const Exposure& exposure = done.exposures[i];
      ASSERT_GE(exposure.time, limits.line_time);
      ASSERT_LE(exposure.time, limits.longest);
      ASSERT_EQ(exposure.time.ns() % limits.line_time.ns(), 0);
      ASSERT_GE(exposure.gain, 1.0);
      ASSERT_LE(exposure.gain, options.max_gain);
      const double step = light_s(exposure) / light_s(done.exposures[i - 1]);
      const double off = scene.mean(done.exposures[i - 1]) / options.target;
      const double limit = within(off, 1.0, kFarOff) ? kGentleStep : kMaxStep;
      if (i > 1) {  // the first image may be beyond the limits of gain
        ASSERT_TRUE(within(step, 1.0, limit * kRounding)) << step;
      }
    }
  });
}

TEST(AutoExposureLaw, TakesNoMoreStepsThanTheRangeOfLightHas) {
  test::for_all(1000, [](Generator& g) {
    Scene scene = random_scene(g);
    const ExposureLimits limits{.line_time = kLineTime, .longest = kLineTime * 1704, .max_gain = kMaxGain};
    // A step is never smaller than the band that ends them, but for rounding.
    const double range = light_s(expose(1e3, limits)) / light_s(expose(0.0, limits));
    const double most = std::log(range) / std::log(kSettledBand / 1.04);
    AutoExposure control({}, limits);
    const Adjustment done = adjust(control, scene, expose(g.uniform(1e-6, 0.1), limits));
    ASSERT_LE(static_cast<double>(done.exposures.size()), most);
    // Where no pixel clips, each step is as long as it may be: by four until within a stop, then by a quarter.
    const double dimmest = std::log(range) / std::log(kMaxStep) + std::log(kFarOff) / std::log(kGentleStep);
    scene.fill_per_s.assign(1, std::pow(10.0, g.uniform(-1.0, 4.5)));
    AutoExposure flat({}, limits);
    const Adjustment straight = adjust(flat, scene, expose(0.0, limits));
    ASSERT_LE(static_cast<double>(straight.exposures.size()), dimmest + 4.0);
  });
}

TEST(AutoExposureLaw, LetsABrightnessWithinTheBandAlone) {
  test::for_all(500, [](Generator& g) {
    const ExposureLimits limits{.line_time = kLineTime, .longest = kLineTime * 1704, .max_gain = kMaxGain};
    AutoExposure control({}, limits);
    Scene scene{.fill_per_s = {std::pow(10.0, g.uniform(0.5, 3.0))}};
    const Exposure settled = adjust(control, scene, expose(0.005, limits)).exposures.back();
    ASSERT_FALSE(control.adjusting());
    for (int i = 0; i < 50; ++i) {
      const double flicker = g.uniform(kSettledBand / kBand + 1e-6, kBand / kSettledBand - 1e-6);
      ASSERT_EQ(control.update(scene.mean(settled) * flicker, settled), settled) << flicker;
    }
  });
}

}  // namespace
}  // namespace plumb::ov7251
