// The noise that follows the innovations: where it settles, what it ignores, and that it can be switched off.

#include "fsw/estimator/pixel_noise.h"

#include <gtest/gtest.h>

#include "test/support/property.h"

namespace plumb {
namespace {

constexpr std::size_t kFeatures = 30;

VisionOptions adapting(double start_px) {
  VisionOptions options;
  options.pixel_noise_px = start_px;
  options.pixel_noise_images = 60;
  return options;
}

/// One image of features whose innovations have this noise, as seen by a filter that takes it for noise.sigma_px().
void observe(test::Generator& g, double true_px, double outliers, PixelNoise<kFeatures>& noise) {
  noise.begin_image();
  for (std::size_t i = 0; i < kFeatures; ++i) {
    const double ratio = (g.uniform(0.0, 1.0) < outliers ? 10.0 : 1.0) * true_px / noise.sigma_px();
    noise.add(g.normal_vector<2>(ratio).squaredNorm());
  }
  noise.follow();
}

TEST(PixelNoise, SettlesAtTheNoiseOfTheInnovations) {
  test::for_all(20, [](test::Generator& g) {
    const double true_px = g.uniform(0.5, 2.0);
    for (const double factor : {0.5, 2.0}) {
      PixelNoise<kFeatures> noise(adapting(factor * true_px));
      for (int image = 0; image < 600; ++image) observe(g, true_px, 0.0, noise);
      EXPECT_NEAR(noise.sigma_px() / true_px, 1.0, 0.06);
    }
  });
}

TEST(PixelNoise, OutliersHardlyMoveIt) {
  test::for_all(20, [](test::Generator& g) {
    PixelNoise<kFeatures> noise(adapting(1.0));
    for (int image = 0; image < 600; ++image) observe(g, 1.0, 0.1, noise);
    EXPECT_NEAR(noise.sigma_px(), 1.07, 0.08);  // the median of the good ones and the bad ones together
  });
}

TEST(PixelNoise, KeepsToItsLimits) {
  test::for_all(5, [](test::Generator& g) {
    for (const double true_px : {0.01, 100.0}) {
      PixelNoise<kFeatures> noise(adapting(1.0));
      for (int image = 0; image < 2000; ++image) observe(g, true_px, 0.0, noise);
      const VisionOptions options = adapting(1.0);
      EXPECT_EQ(noise.sigma_px(), true_px < 1.0 ? options.pixel_noise_min_px : options.pixel_noise_max_px);
    }
  });
}

TEST(PixelNoise, StaysWhereNothingCanBeLearnt) {
  test::for_all(5, [](test::Generator& g) {
    VisionOptions fixed = adapting(1.0);
    fixed.pixel_noise_images = 0;
    PixelNoise<kFeatures> off(fixed);
    observe(g, 5.0, 0.0, off);
    EXPECT_EQ(off.sigma_px(), 1.0);
    PixelNoise<kFeatures> few(adapting(1.0));
    for (int i = 0; i < 7; ++i) few.add(50.0);
    for (std::size_t i = 0; i < kFeatures; ++i) few.add(NAN);
    few.follow();
    EXPECT_EQ(few.sigma_px(), 1.0);
    few.clear();
    observe(g, 5.0, 0.0, few);
    EXPECT_GT(few.sigma_px(), 1.0);
    few.clear();
    EXPECT_EQ(few.sigma_px(), 1.0);
  });
}

}  // namespace
}  // namespace plumb
