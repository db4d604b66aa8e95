#include "test/support/opencv_tracker/opencv_kernels.h"

#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

namespace plumb {
namespace {

constexpr int kFastRadius_px = 3;

}  // namespace

OpenCvKernels::OpenCvKernels(const CameraCalibration&, const TrackerOptions& options) : options_(options) {}

void OpenCvKernels::push(const ImageView& image) {
  present_ = 1 - present_;
  if (images_ < 2) ++images_;
  // OpenCV takes a pointer to mutable pixels but only reads them here: the pyramid holds a padded copy.
  const cv::Mat view(image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.pixels),
                     static_cast<std::size_t>(image.stride));
  cv::buildOpticalFlowPyramid(view, pyramid_[present_], cv::Size(options_.window_px, options_.window_px),
                              options_.levels - 1, true, cv::BORDER_REFLECT_101, cv::BORDER_CONSTANT, false);
}

void OpenCvKernels::forget() { images_ = 0; }

ImageView OpenCvKernels::present() const {
  const cv::Mat& image = pyramid_[present_].front();
  return {image.data, image.cols, image.rows, static_cast<std::int32_t>(image.step)};
}

void OpenCvKernels::follow(std::span<FlowPoint> points) {
  for (FlowPoint& point : points) point.found = false;
  if (points.empty() || images_ < 2) return;
  from_.clear();
  to_.clear();
  for (const FlowPoint& point : points) {
    from_.emplace_back(point.from_u_px, point.from_v_px);
    to_.emplace_back(point.to_u_px, point.to_v_px);
  }
  const cv::TermCriteria stop(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, options_.max_iterations,
                              options_.epsilon_px);
  cv::calcOpticalFlowPyrLK(pyramid_[1 - present_], pyramid_[present_], from_, to_, status_, error_,
                           cv::Size(options_.window_px, options_.window_px), options_.levels - 1, stop,
                           cv::OPTFLOW_USE_INITIAL_FLOW, options_.min_eigenvalue);
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i].to_u_px = to_[i].x;
    points[i].to_v_px = to_[i].y;
    points[i].residual = error_[i];
    points[i].found = status_[i] != 0;
  }
}

void OpenCvKernels::detect(const TileRect& rect, std::int32_t threshold, CornerSink& sink) {
  const cv::Mat& image = pyramid_[present_].front();
  // FAST does not look at the outer 3 px of what it is given; the border of the tiles leaves room for them.
  const cv::Rect region(rect.left - kFastRadius_px, rect.top - kFastRadius_px,
                        rect.right - rect.left + 2 * kFastRadius_px, rect.bottom - rect.top + 2 * kFastRadius_px);
  cv::FAST(image(region), corners_, threshold, true);
  for (const cv::KeyPoint& corner : corners_) {
    sink.offer(
        {corner.pt.x + static_cast<float>(region.x), corner.pt.y + static_cast<float>(region.y), corner.response});
  }
}

}  // namespace plumb
