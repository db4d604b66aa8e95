#pragma once
// Counters of what the estimator did with its inputs: per frame for the log, in total for health.

#include <array>
#include <cstddef>
#include <cstdint>

namespace plumb {

/// Why a range was or was not used. Exactly one per range sample.
enum class RangeOutcome : std::uint8_t {
  kNone = 0,  ///< no range in this frame
  kUsed,
  kGated,        ///< failed the Mahalanobis gate
  kNoFacet,      ///< no facet under the beam
  kBadGeometry,  ///< grazing incidence, facet too large, or depth not in front
  kStale,        ///< too old, or at or before the horizon
  kFeature,      ///< given to the feature track at the laser's spot
  kSpare,        ///< no track took it and no facet was asked: ranged tracks serve, or facets are off
};

struct FrameReport {
  std::uint32_t tracks = 0;         ///< features seen in this image
  std::uint32_t slam_features = 0;  ///< in the state after this frame
  std::uint32_t slam_used = 0;
  std::uint32_t slam_rejected = 0;
  std::uint32_t slam_added = 0;
  double slam_nis =
      0.0;  ///< normalised innovations squared, summed over slam_used and slam_rejected; ideally 2 of each
  std::uint32_t msckf_used = 0;
  std::uint32_t msckf_rejected = 0;
  double track_nis = 0.0;        ///< the same of tracks, summed over those judged, refused ones too; ideally track_rows
  std::uint32_t track_rows = 0;  ///< rows of these, less three for each feature
  std::uint32_t ranged_used = 0;  ///< of the tracks used, those with a range
  std::uint32_t ranged_rejected = 0;
  double ranged_nis = 0.0;          ///< what ranges add to the NIS of their tracks; ideally ranged_judged
  std::uint32_t ranged_judged = 0;  ///< tracks that could be judged with the range and without
  std::uint32_t ranges_used = 0;
  RangeOutcome range_outcome = RangeOutcome::kNone;  ///< of the newest range of this frame
  std::array<std::uint32_t, 3> range_facet{};  ///< track ids of the facet's vertices; all zero: none under the beam
  std::uint32_t range_feature = 0;             ///< track that took the range, or feature it was compared with
  double range_measured_m = 0.0;
  double range_predicted_m = 0.0;
  double range_sigma_m = 0.0;  ///< of the innovation
  bool zero_velocity = false;  ///< the zero-velocity update ran
  std::uint32_t directions_used = 0;
  bool heading_known = false;  ///< W has its x axis east
};

struct EstimatorCounters {
  std::uint64_t imu_samples = 0;
  std::uint64_t imu_out_of_order = 0;
  std::uint64_t imu_invalid = 0;   ///< not finite or beyond the limits
  std::uint64_t imu_gaps = 0;      ///< longer than what is bridged
  std::uint64_t imu_overflow = 0;  ///< starts anew because no image came for too long
  std::uint64_t frames = 0;
  std::uint64_t frames_out_of_order = 0;
  std::uint64_t frames_without_imu = 0;
  std::uint64_t ranges = 0;
  std::uint64_t ranges_used = 0;
  std::uint64_t ranges_feature = 0;
  std::uint64_t ranges_spare = 0;
  std::uint64_t ranges_gated = 0;
  std::uint64_t ranges_no_facet = 0;
  std::uint64_t ranges_bad_geometry = 0;
  std::uint64_t ranges_stale = 0;
  std::uint64_t ranges_invalid = 0;
  std::uint64_t directions = 0;
  std::uint64_t directions_used = 0;
  std::uint64_t directions_gated = 0;
  std::uint64_t directions_spare = 0;    ///< another of the same image was used, or it came too late
  std::uint64_t directions_invalid = 0;  ///< not a direction, or out of order
  std::uint64_t numerical_faults = 0;
  std::uint64_t resets = 0;
};

/// Every calibration value as its difference from the calibration file, with sigma (0: not estimated): scale of gyro
/// and accelerometer (3 + 3); time offset of images, s; camera rotation in I, rad (3); camera position in I, m (3);
/// tilt of the range finder's beam, rad (2); its origin in C, m (3).
struct CalibrationReport {
  static constexpr std::size_t kSize = 18;
  std::array<double, kSize> value{};
  std::array<double, kSize> sigma{};
};

/// Files one range under its outcome, so that the range counters add up to `ranges`.
inline void count_range(EstimatorCounters& counters, RangeOutcome outcome) {
  switch (outcome) {
    case RangeOutcome::kUsed: ++counters.ranges_used; return;
    case RangeOutcome::kFeature: ++counters.ranges_feature; return;
    case RangeOutcome::kSpare: ++counters.ranges_spare; return;
    case RangeOutcome::kGated: ++counters.ranges_gated; return;
    case RangeOutcome::kNoFacet: ++counters.ranges_no_facet; return;
    case RangeOutcome::kBadGeometry: ++counters.ranges_bad_geometry; return;
    case RangeOutcome::kStale: ++counters.ranges_stale; return;
    case RangeOutcome::kNone: return;
  }
}

}  // namespace plumb
