#pragma once
// Image kernels by OpenCV: the oracle for the flight kernels. They allocate in every call.
// The program is expected to call cv::setNumThreads(1).

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include <opencv2/core.hpp>

#include "fsw/measurement/samples.h"
#include "fsw/vision/image_kernels.h"
#include "fsw/vision/tracker_options.h"

namespace plumb {

class OpenCvKernels {
 public:
  OpenCvKernels(const CameraCalibration& calibration, const TrackerOptions& options);
  void push(const ImageView& image);
  void forget();
  ImageView present() const;
  void follow(std::span<FlowPoint> points);
  void detect(const TileRect& rect, std::int32_t threshold, CornerSink& sink);

 private:
  TrackerOptions options_;
  std::array<std::vector<cv::Mat>, 2> pyramid_;  ///< of the last two images
  std::size_t present_ = 0;                      ///< which of them is the present one
  int images_ = 0;                               ///< how many of them hold an image

  // Reused from frame to frame.
  std::vector<cv::Point2f> from_;
  std::vector<cv::Point2f> to_;
  std::vector<std::uint8_t> status_;
  std::vector<float> error_;
  std::vector<cv::KeyPoint> corners_;
};

}  // namespace plumb
