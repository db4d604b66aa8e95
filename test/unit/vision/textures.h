#pragma once
// Random grey images for the pixel kernels: from smooth to noise, with everything that is hard for them in between.

#include <cstdint>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "fsw/measurement/samples.h"
#include "test/support/property.h"

namespace plumb::test {

/// Noise, blurred by a random width and stretched to all grey levels; every third image is also black and white alone.
inline cv::Mat random_texture(Generator& g, int width, int height) {
  cv::Mat noise(height, width, CV_8UC1);
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) noise.at<std::uint8_t>(v, u) = static_cast<std::uint8_t>(g.integer(0, 255));
  }
  const double sigma_px = g.uniform(0.0, 4.0);
  if (sigma_px > 0.3) cv::GaussianBlur(noise, noise, cv::Size(), sigma_px);
  cv::normalize(noise, noise, 0, 255, cv::NORM_MINMAX);
  if (g.integer(0, 2) == 0) cv::threshold(noise, noise, 127, 255, cv::THRESH_BINARY);
  return noise;
}

inline ImageView view_of(const cv::Mat& image) {
  return {image.data, image.cols, image.rows, static_cast<std::int32_t>(image.step)};
}

}  // namespace plumb::test
