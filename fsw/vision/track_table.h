#pragma once
// Feature tracks as the estimator needs them: for every live identity, the observations not yet used by an update.

#include <cstdint>
#include <optional>

#include "fsw/base/hash.h"
#include "fsw/math/so3.h"
#include "fsw/vision/feature_frame.h"

namespace plumb {

struct TrackSample {
  std::uint32_t sequence = 0;  ///< of the image it was seen in
  Vec2 z = Vec2::Zero();       ///< undistorted, normalised image plane
};

/// How the depth from a range hangs on the beam: it changes by axis_C . (change of the spot).
struct RangeRay {
  double range_m = 0.0;
  Vec3 spot_C_m = Vec3::Zero();  ///< where the beam was taken to end, in the camera at the time of the range
  Vec3 axis_C = Vec3::Zero();    ///< there, the optical axis at the time of the image
};

/// What a range finder says of the depth of a track, in one of the images it was seen in.
struct TrackRange {
  std::uint32_t sequence = 0;  ///< of that image
  double rho_1_m = 0.0;        ///< inverse depth along the optical axis there
  double sigma_1_m = 0.0;
  bool stays = false;           ///< the laser stays at the track, and no parallax is to be expected
  std::optional<RangeRay> ray;  ///< when the beam is being calibrated
};

template <std::size_t MaxLength>
struct Track {
  std::uint32_t id = 0;
  std::uint32_t age = 0;                        ///< images it has been seen in, used observations included
  bool alive = false;                           ///< seen in the newest image
  bool in_state = false;                        ///< it is a SLAM feature
  bool banned = false;                          ///< evicted as an outlier: follow it no more
  FixedVector<TrackSample, MaxLength> samples;  ///< unused observations, oldest first, one per image at most
  std::optional<TrackRange> range;              ///< not yet used

  /// The observation and the range that belongs to it.
  void forget(std::size_t sample) {
    if (range && range->sequence == samples[sample].sequence) range.reset();
    samples.erase(sample);
  }
  void use_up() {
    samples.clear();
    range.reset();
  }
};

/// MaxLength is the number of poses in the window: an older observation has no pose to belong to.
template <std::size_t MaxTracks, std::size_t MaxLength>
class TrackTable {
 public:
  using TrackType = Track<MaxLength>;
  // Tracks that end with this image stand beside all that are alive until drop_ended().
  using Tracks = FixedVector<TrackType, 2 * MaxTracks>;

  Tracks& tracks() { return tracks_; }
  const Tracks& tracks() const { return tracks_; }
  void clear() { tracks_.clear(); }

  /// Appends one image's observations; both lists are in order of id. Tracks that are not in the frame become ended.
  void append(const FeatureFrame<MaxTracks>& frame) {
    for (TrackType& track : tracks_) track.alive = false;
    std::size_t next = 0;
    const std::size_t known = tracks_.size();
    for (const FeatureObservation& seen : frame.observations) {
      while (next < known && tracks_[next].id < seen.track_id) ++next;
      TrackType* track = nullptr;
      if (next < known && tracks_[next].id == seen.track_id) {
        track = &tracks_[next];
      } else {
        if (tracks_.size() > known && tracks_.back().id >= seen.track_id) continue;  // not increasing: drop it
        if (known > 0 && tracks_[known - 1].id >= seen.track_id) continue;           // an ended identity came back
        if (!ok(tracks_.push_back(TrackType{}))) continue;
        track = &tracks_.back();
        track->id = seen.track_id;
      }
      track->alive = true;
      ++track->age;
      if (track->samples.full()) track->forget(0);
      static_cast<void>(track->samples.push_back({frame.sequence, Vec2(seen.x, seen.y)}));
    }
  }

  void drop_ended() {
    tracks_.erase_if([](const TrackType& track) { return !track.alive; });
  }

  /// Null when there is no such track.
  TrackType* find(std::uint32_t id) {
    std::size_t low = 0;
    std::size_t high = tracks_.size();
    while (low < high) {
      const std::size_t middle = (low + high) / 2;
      if (tracks_[middle].id < id) {
        low = middle + 1;
      } else {
        high = middle;
      }
    }
    return low < tracks_.size() && tracks_[low].id == id ? &tracks_[low] : nullptr;
  }

  /// Every bit of every track.
  void add_to(Hash64& hash) const {
    for (const TrackType& track : tracks_) {
      const std::uint64_t flags = (track.alive ? 1U : 0U) | (track.in_state ? 2U : 0U) | (track.banned ? 4U : 0U);
      for (const std::uint64_t word : {std::uint64_t{track.id}, std::uint64_t{track.age}, flags}) hash.add(word);
      hash.add(std::uint64_t{track.samples.size()});
      for (const TrackSample& sample : track.samples) {
        hash.add(std::uint64_t{sample.sequence});
        hash.add(sample.z.data(), 2);
      }
      hash.add(std::uint64_t{track.range ? 1U : 0U});
      if (!track.range) continue;
      hash.add(std::uint64_t{track.range->sequence});
      hash.add(track.range->rho_1_m);
      hash.add(track.range->sigma_1_m);
      hash.add(std::uint64_t{track.range->stays ? 1U : 0U});
      if (!track.range->ray) continue;
      hash.add(track.range->ray->range_m);
      hash.add(track.range->ray->spot_C_m.data(), 3);
      hash.add(track.range->ray->axis_C.data(), 3);
    }
  }

 private:
  Tracks tracks_;
};

}  // namespace plumb
