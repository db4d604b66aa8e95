#include "fsw/vision/tracker_options.h"

#include <algorithm>
#include <cmath>

namespace plumb {
namespace {

constexpr std::int32_t kMaxIterations = 100;
constexpr std::int32_t kMaxGrey = 255;

bool within(std::int32_t value, std::int32_t low, std::int32_t high) { return value >= low && value <= high; }
bool positive(double value) { return std::isfinite(value) && value > 0.0; }

}  // namespace

bool TrackerOptions::has_room(const TrackerOptions& options, const CameraCalibration& calibration) {
  const std::int32_t inner_width_px = calibration.width - 2 * (options.border_px + 1);
  const std::int32_t inner_height_px = calibration.height - 2 * (options.border_px + 1);
  return inner_width_px >= std::max(options.tile_columns, options.window_px) &&
         inner_height_px >= std::max(options.tile_rows, options.window_px);
}

Status TrackerOptions::check(const TrackerOptions& options, const CameraCalibration& calibration,
                             std::size_t max_tracks) {
  if (!ok(CameraModel::check(calibration))) return Status::kInvalidValue;
  if (!within(options.max_features, 1, static_cast<std::int32_t>(max_tracks))) return Status::kInvalidValue;
  if (!within(options.tile_columns, 1, static_cast<std::int32_t>(kMaxTiles))) return Status::kInvalidValue;
  if (!within(options.tile_rows, 1, static_cast<std::int32_t>(kMaxTiles) / options.tile_columns)) {
    return Status::kInvalidValue;
  }
  if (options.min_distance_px < 0 || options.border_px < kMinBorder_px) return Status::kInvalidValue;
  if (options.fast_threshold_min < 1 || options.fast_threshold_max > kMaxGrey ||
      options.fast_threshold_min > options.fast_threshold_max) {
    return Status::kInvalidValue;
  }
  if (!within(options.window_px, 5, kMaxWindow_px) || options.window_px % 2 == 0) return Status::kInvalidValue;
  if (!within(options.levels, 1, kMaxPyramidLevels)) return Status::kInvalidValue;
  if (!within(options.max_iterations, 1, kMaxIterations)) return Status::kInvalidValue;
  if (!positive(options.epsilon_px) || !positive(options.min_eigenvalue)) return Status::kInvalidValue;
  if (!positive(options.max_residual) || !positive(options.outlier_px)) return Status::kInvalidValue;
  if (!(options.min_similarity > 0.0 && options.min_similarity < 1.0)) return Status::kInvalidValue;
  if (!positive(options.max_correction_px)) return Status::kInvalidValue;
  return has_room(options, calibration) ? Status::kOk : Status::kInvalidValue;
}

}  // namespace plumb
