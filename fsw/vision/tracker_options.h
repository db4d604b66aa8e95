#pragma once
// Settings of the feature tracker. The defaults come from measurements on EuRoC MH_01 (752 x 480, 20 Hz): pixel error
// after bundle adjustment over 12 images, number of tracks that last 12 images, and time.

#include <cstddef>
#include <cstdint>

#include "fsw/base/status.h"
#include "fsw/vision/camera_model.h"

namespace plumb {

inline constexpr std::size_t kMaxTiles = 64;

struct TrackerOptions {
  // Number and spread of the features.
  std::int32_t max_features = 160;  ///< live tracks kept at once; at most the tracker's MaxTracks
  std::int32_t tile_columns = 8;    ///< detection tiles; columns x rows at most kMaxTiles
  std::int32_t tile_rows = 6;
  std::int32_t min_distance_px = 16;  ///< between a new feature and every live one
  std::int32_t border_px = 8;         ///< features nearer to the image edge are dropped; at least kMinBorder_px

  // Detection: FAST, whose threshold follows the texture of each tile between these bounds [grey levels].
  std::int32_t fast_threshold_min = 7;
  std::int32_t fast_threshold_max = 40;

  // Pyramidal Lucas-Kanade.
  std::int32_t window_px = 13;       ///< odd side of the square patch, at most kMaxWindow_px
  std::int32_t levels = 4;           ///< pyramid levels including the full image; at most kMaxPyramidLevels
  std::int32_t max_iterations = 12;  ///< per level
  double epsilon_px = 0.02;          ///< a smaller step ends the iteration
  double min_eigenvalue = 1e-4;      ///< of the patch's structure tensor, in OpenCV's normalisation
  bool light_change = true;          ///< follow patches whose light changes by a gain and an offset

  // Rejection.
  double max_residual = 25.0;      ///< mean absolute grey-level difference of the patch
  double min_similarity = 0.8;     ///< correlation with the patch it was first seen as, below which a feature ends
  double max_correction_px = 1.0;  ///< between the flow and the alignment with that patch, above which likewise
  double outlier_px = 0.4;         ///< distance to the epipolar line, at the mean focal length
  std::uint64_t ransac_seed = 0x9E3779B97F4A7C15ULL;

  static constexpr std::int32_t kMinBorder_px = 4;  ///< FAST reads a circle of radius 3
  static constexpr std::int32_t kMaxPyramidLevels = 6;
  static constexpr std::int32_t kMaxWindow_px = 21;  ///< so that sums over a patch fit in 32 bits, see grey_samples.h

  /// Whether the image is large enough for border, tiles and patch.
  static bool has_room(const TrackerOptions& options, const CameraCalibration& calibration);
  /// kInvalidValue when a setting is out of its range, or has_room() does not hold.
  static Status check(const TrackerOptions& options, const CameraCalibration& calibration, std::size_t max_tracks);
};

}  // namespace plumb
