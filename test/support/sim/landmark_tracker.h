#pragma once
// A feature tracker that knows the answer: it follows points on the world's surfaces and reports where the camera sees
// them, with pixel noise, and with the failures asked for.

#include <cstdint>
#include <span>
#include <vector>

#include "fsw/vision/feature_frame.h"
#include "test/support/sim/random.h"
#include "test/support/sim/rig.h"
#include "test/support/sim/world.h"

namespace plumb::sim {

struct TrackerOptions {
  int target_tracks = 150;  ///< kept up as long as the surface gives features
  int tiles_x = 8;          ///< new features go to the emptiest tile
  int tiles_y = 6;
  double pixel_noise_px = 0.5;  ///< 1 sigma, per axis
  double min_spacing_px = 8.0;  ///< between a new feature and the others
  double border_px = 4.0;       ///< a track closer to the image edge than this ends
  double max_depth_m = 200.0;
  bool occlusion = true;   ///< a track whose landmark is hidden ends
  bool side_faces = true;  ///< landmarks on walls too
  double dropout = 0.0;    ///< probability, per track and image, that the track ends
  double outlier = 0.0;    ///< that one observation is displaced by up to outlier_px, once
  double outlier_px = 30.0;
  double mismatch = 0.0;  ///< that the track jumps to another landmark within mismatch_px, for good
  double mismatch_px = 15.0;
};

/// A live track and the point it follows.
struct LandmarkTrack {
  std::uint32_t id = 0;
  Vec3 landmark_m = Vec3::Zero();  ///< in W
  Vec2 true_px = Vec2::Zero();     ///< noise-free position in the last image
};

class LandmarkTracker {
 public:
  /// World and rig must outlive the tracker.
  LandmarkTracker(const TrackerOptions& options, const World& world, const Rig& rig, std::uint64_t seed);

  /// The camera sees from this state. The result is in strictly increasing id and lives until the next call.
  /// Tracks are started at the `wanted` points (normalised image plane) first, also beyond target_tracks, but never
  /// more than `most` in all.
  const std::vector<FeatureObservation>& observe(const TruthState& truth, std::span<const Vec2> wanted = {},
                                                 std::size_t most = SIZE_MAX);
  /// Ends every track; ids go on.
  void reset() { tracks_.clear(); }

  /// Those of the last observe(), in the same order as its result.
  const std::vector<LandmarkTrack>& tracks() const { return tracks_; }

 private:
  bool project(const TruthState& truth, const Vec3& landmark_m, Vec2& pixel) const;
  bool still_seen(const TruthState& truth, LandmarkTrack& track);
  void mismatch(const TruthState& truth, LandmarkTrack& track);
  void drop_crowded();
  void start_wanted(const TruthState& truth, std::span<const Vec2> wanted, std::size_t most);
  void replenish(const TruthState& truth);
  bool start_track(const TruthState& truth, int tile);
  /// A track at this pixel, unless another is nearer than the spacing or there is no surface.
  bool start_at(const TruthState& truth, const Vec2& pixel, double spacing_px);
  bool find_landmark(const TruthState& truth, const Vec2& pixel, Vec3& landmark_m) const;
  int tile_of(const Vec2& pixel) const;
  void report();

  TrackerOptions options_;
  const World& world_;
  const Rig& rig_;
  CameraModel camera_;
  Random random_;
  std::uint32_t next_id_ = 1;
  std::vector<LandmarkTrack> tracks_;
  std::vector<FeatureObservation> observations_;
};

}  // namespace plumb::sim
