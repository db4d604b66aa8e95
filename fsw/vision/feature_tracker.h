#pragma once
// The tracker's logic, which is the same whoever works on the pixels (Kernels, see image_kernels.h): prediction,
// checks, outlier rejection, quotas and the track table.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "fsw/base/fixed_vector.h"
#include "fsw/vision/camera_model.h"
#include "fsw/vision/image_kernels.h"
#include "fsw/vision/patch_template.h"
#include "fsw/vision/ransac.h"
#include "fsw/vision/spacing_mask.h"
#include "fsw/vision/tiles.h"
#include "fsw/vision/tracker.h"
#include "fsw/vision/tracker_options.h"

namespace plumb {

/// What became of the tracks in the last frame, for telemetry and tuning.
struct TrackerReport {
  std::uint32_t before = 0;           ///< live tracks before the frame
  std::uint32_t lost_prediction = 0;  ///< predicted outside the image
  std::uint32_t lost_flow = 0;        ///< not followed from the last image, or too near to the edge
  std::uint32_t lost_patch = 0;       ///< not found again as the patch that they started as
  std::uint32_t lost_outlier = 0;     ///< two-view outliers
  std::uint32_t lost_crowded = 0;     ///< ran into an older track
  std::uint32_t started = 0;          ///< new features
  std::uint32_t started_wanted = 0;   ///< of these, at points that the filter asked for
  std::uint32_t searched_tiles = 0;   ///< tiles in which corners were looked for
  bool outliers_judged = false;       ///< false: too few tracks or no common motion, and so nothing was rejected
};

template <std::size_t MaxTracks, class Kernels>
class FeatureTracker final : public Tracker<MaxTracks> {
  static_assert(MaxTracks <= TwoViewRansac::kMaxMatches, "outlier rejection has no room for that many tracks");

 public:
  /// Precondition: TrackerOptions::check(options, calibration, MaxTracks) is kOk.
  FeatureTracker(const CameraCalibration& calibration, const TrackerOptions& options);

  [[nodiscard]] Status track(const CameraFrame& frame, const MotionPrediction& motion,
                             FeatureFrame<MaxTracks>& out) override;
  /// Only options that nothing has been laid out by: what the others say stays.
  void use(const TrackerOptions& options) override {
    options_.max_residual = options.max_residual;
    options_.min_similarity = options.min_similarity;
    options_.max_correction_px = options.max_correction_px;
    options_.outlier_px = options.outlier_px;
    ransac_.set_threshold_rad(options.outlier_px / camera_.focal_px());
    options_.fast_threshold_min = options.fast_threshold_min;
    options_.fast_threshold_max = options.fast_threshold_max;
    for (std::int32_t& threshold : fast_threshold_) {
      threshold = std::clamp(threshold, options.fast_threshold_min, options.fast_threshold_max);
    }
  }
  void reset() override;
  const TrackerReport& report() const { return report_; }

 private:
  struct Track {
    std::uint32_t id = 0;
    float u_px = 0.0F;
    float v_px = 0.0F;
    Vec2 normalised = Vec2::Zero();
    Vec3 bearing_C = Vec3::UnitZ();      ///< unit vector
    Vec3 bearing_Cprev = Vec3::UnitZ();  ///< the same in the image before
    Vec2 rotated_px = Vec2::Zero();      ///< where the rotation alone takes the feature in the present image
    Vec2 drift_px = Vec2::Zero();        ///< motion of the last interval beyond what the rotation explains
    Quat q_CCanchor = Quat::Identity();  ///< rotation since the patch was taken
    float patch_scale = 1.0F;            ///< size of the patch in the last image over its size when it was taken
    std::uint16_t slot = 0;              ///< its place in anchors_
    bool keep = true;
  };
  /// The patch of a track and where the camera saw it when it was taken.
  struct Anchor {
    PatchTemplate patch;
    Vec3 ray_C = Vec3::UnitZ();                 ///< on the plane z = 1
    Mat2 normalised_per_px = Mat2::Identity();  ///< inverse Jacobian of the camera model there
  };

  Status check_frame(const CameraFrame& frame) const;
  void predict(const MotionPrediction& motion, double interval_ratio);
  void follow();
  void align(const MotionPrediction& motion);
  bool align_track(const MotionPrediction& motion, Track& track, const FlowPoint& point);
  bool anchor(const Track& track);
  void reject_outliers(const MotionPrediction& motion);
  void drop_crowded();
  std::uint32_t drop_unkept();
  void start_wanted(const MotionPrediction& motion);
  bool crowded(const Vec2& pixel) const;
  void detect();
  void search_tile(std::size_t tile, std::int32_t wanted);
  void start_tracks(std::size_t tile, std::int32_t level, std::int32_t quota);
  bool start_track(const Corner& corner);
  void publish(const CameraFrame& frame, FeatureFrame<MaxTracks>& out) const;
  bool locate(Track& track) const;
  bool inside(double u_px, double v_px) const;

  CameraModel camera_;
  TrackerOptions options_;
  Kernels kernels_;
  TwoViewRansac ransac_;
  TileGrid<kMaxTiles> tiles_;
  SpacingMask mask_;

  FixedVector<Track, MaxTracks> tracks_;      ///< in order of id
  FixedVector<FlowPoint, MaxTracks> points_;  ///< point i belongs to track i
  std::array<Anchor, MaxTracks> anchors_;
  FixedVector<std::uint16_t, MaxTracks> free_slots_;
  FixedVector<BearingMatch, MaxTracks> matches_;
  std::array<BestCorners<kCornersPerTile>, kMaxTiles> candidates_;
  std::array<bool, kMaxTiles> searched_{};               ///< tiles whose candidates are of the present image
  std::array<std::size_t, kMaxTiles> next_candidate_{};  ///< of them the first that was not looked at
  std::array<std::int32_t, kMaxTiles> fast_threshold_{};
  TwoViewRansac::Outcome outcome_;
  TrackerReport report_;

  std::uint32_t next_id_ = 0;
  Time last_t_ = Time::never();
  double last_interval_s_ = 0.0;
};

}  // namespace plumb
