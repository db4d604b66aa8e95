#pragma once
// Definitions of FeatureTracker, for the source files that instantiate it.

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "fsw/math/exact.h"
#include "fsw/vision/feature_tracker.h"

namespace plumb {
namespace tracker_detail {

inline constexpr std::int32_t kFirstThreshold = 20;  // grey levels; the usual FAST setting, adapted from there
inline constexpr int kMaxSearchPasses = 3;           // 20, 10, 5: enough to find the level of a dark tile at once
inline constexpr std::int32_t kManyCorners = 4 * static_cast<std::int32_t>(kCornersPerTile);
inline constexpr double kMaxIntervalRatio = 3.0;    // further extrapolation does more harm than good
inline constexpr double kCrowdedShare = 0.35;       // of the minimum distance: two tracks that close are one
inline constexpr std::int32_t kBirthMargin_px = 1;  // a feature born on the border would be lost to the first rounding
inline constexpr double kMinForward = 0.05;         // cosine of the field angle beyond which z = 1 is useless

inline RansacOptions ransac_options(const CameraModel& camera, const TrackerOptions& options) {
  RansacOptions ransac;
  ransac.threshold_rad = options.outlier_px / camera.focal_px();
  ransac.seed = options.ransac_seed;
  return ransac;
}

}  // namespace tracker_detail

template <std::size_t MaxTracks, class Kernels>
FeatureTracker<MaxTracks, Kernels>::FeatureTracker(const CameraCalibration& calibration, const TrackerOptions& options)
    : camera_(calibration),
      options_(options),
      kernels_(calibration, options),
      ransac_(tracker_detail::ransac_options(camera_, options)),
      tiles_(calibration.width, calibration.height, options.tile_columns, options.tile_rows,
             options.border_px + tracker_detail::kBirthMargin_px),
      mask_(calibration.width, calibration.height, options.min_distance_px) {
  PLUMB_ASSERT(ok(TrackerOptions::check(options, calibration, MaxTracks)));
  reset();
}

template <std::size_t MaxTracks, class Kernels>
void FeatureTracker<MaxTracks, Kernels>::reset() {
  tracks_.clear();
  free_slots_.clear();
  for (std::size_t slot = MaxTracks; slot > 0; --slot) {
    (void)free_slots_.push_back(static_cast<std::uint16_t>(slot - 1));
  }
  kernels_.forget();
  ransac_.reset();
  fast_threshold_.fill(
      std::clamp(tracker_detail::kFirstThreshold, options_.fast_threshold_min, options_.fast_threshold_max));
  report_ = TrackerReport{};
  last_t_ = Time::never();
  last_interval_s_ = 0.0;
}

template <std::size_t MaxTracks, class Kernels>
Status FeatureTracker<MaxTracks, Kernels>::track(const CameraFrame& frame, const MotionPrediction& motion,
                                                 FeatureFrame<MaxTracks>& out) {
  const Status status = check_frame(frame);
  if (!ok(status)) return status;
  const bool first = last_t_ == Time::never();
  const double interval_s = first ? 0.0 : (frame.t_exposure_mid - last_t_).seconds();
  const double ratio = last_interval_s_ > 0.0 ? interval_s / last_interval_s_ : 0.0;
  last_t_ = frame.t_exposure_mid;
  last_interval_s_ = interval_s;
  report_ = TrackerReport{};
  report_.before = static_cast<std::uint32_t>(tracks_.size());

  kernels_.push(frame.image);
  if (!tracks_.empty()) {
    const MotionPrediction usable =
        motion.valid && motion.q_CnowCprev.coeffs().allFinite() ? motion : MotionPrediction{};
    predict(usable, std::fmin(ratio, tracker_detail::kMaxIntervalRatio));
    follow();
    align(usable);
    reject_outliers(usable);
    drop_crowded();
  }
  start_wanted(motion);
  detect();
  publish(frame, out);
  return Status::kOk;
}

template <std::size_t MaxTracks, class Kernels>
Status FeatureTracker<MaxTracks, Kernels>::check_frame(const CameraFrame& frame) const {
  const ImageView& image = frame.image;
  const CameraCalibration& calibration = camera_.calibration();
  if (image.pixels == nullptr || image.width != calibration.width || image.height != calibration.height ||
      image.stride < image.width || frame.t_exposure_mid == Time::never()) {
    return Status::kInvalidValue;
  }
  return frame.t_exposure_mid > last_t_ ? Status::kOk : Status::kOutOfOrder;
}

// The rotation comes from the gyro; what it does not explain (translation over depth, gyro bias) is taken to go on as
// in the last interval.
template <std::size_t MaxTracks, class Kernels>
void FeatureTracker<MaxTracks, Kernels>::predict(const MotionPrediction& motion, double interval_ratio) {
  const Mat3 rotation = motion.q_CnowCprev.normalized().toRotationMatrix();
  points_.clear();
  for (Track& track : tracks_) {
    const Vec3 rotated = rotation * track.bearing_C;
    track.bearing_Cprev = track.bearing_C;
    track.keep = rotated.z() > tracker_detail::kMinForward &&
                 ok(camera_.distort(rotated.template head<2>() / rotated.z(), track.rotated_px));
    if (!track.keep) continue;
    const Vec2 guess = track.rotated_px + interval_ratio * track.drift_px;
    track.keep = inside(guess.x(), guess.y());
    if (!track.keep) continue;
    (void)points_.push_back({track.u_px, track.v_px, static_cast<float>(guess.x()), static_cast<float>(guess.y())});
  }
  report_.lost_prediction = drop_unkept();
}

template <std::size_t MaxTracks, class Kernels>
void FeatureTracker<MaxTracks, Kernels>::follow() {
  kernels_.follow({points_.data(), points_.size()});
  std::size_t kept = 0;
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    const FlowPoint& point = points_[i];
    tracks_[i].keep = point.found && static_cast<double>(point.residual) <= options_.max_residual &&
                      inside(static_cast<double>(point.to_u_px), static_cast<double>(point.to_v_px));
    if (tracks_[i].keep) points_[kept++] = point;
  }
  points_.resize(kept);
  report_.lost_flow = drop_unkept();
}

// A track whose patch is not found again ends: given a new one it would go on as another point, and the filter would
// take the step between the two for motion.
template <std::size_t MaxTracks, class Kernels>
void FeatureTracker<MaxTracks, Kernels>::align(const MotionPrediction& motion) {
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    Track& track = tracks_[i];
    track.keep = align_track(motion, track, points_[i]) &&
                 inside(static_cast<double>(track.u_px), static_cast<double>(track.v_px)) && locate(track);
    if (track.keep)
      track.drift_px = Vec2(static_cast<double>(track.u_px), static_cast<double>(track.v_px)) - track.rotated_px;
  }
  report_.lost_patch = drop_unkept();
}

// The patch is warped by what the rotation since its capture, and the lens, do to it; how it grows as the camera comes
// nearer is found by the alignment itself.
template <std::size_t MaxTracks, class Kernels>
bool FeatureTracker<MaxTracks, Kernels>::align_track(const MotionPrediction& motion, Track& track,
                                                     const FlowPoint& point) {
  track.q_CCanchor = (motion.q_CnowCprev * track.q_CCanchor).normalized();
  const Anchor& anchor = anchors_[track.slot];
  const Mat3 rotation = track.q_CCanchor.toRotationMatrix();
  const Vec3 ray_C = rotation * anchor.ray_C;
  if (!(ray_C.z() > tracker_detail::kMinForward)) return false;
  const Vec2 normalised = ray_C.template head<2>() / ray_C.z();
  Vec2 pixel;
  Mat2 px_per_normalised;
  if (!ok(camera_.distort(normalised, pixel, px_per_normalised))) return false;
  const Mat2 turn =
      (rotation.template topLeftCorner<2, 2>() - normalised * rotation.template block<1, 2>(2, 0)) / ray_C.z();
  PatchPosition position{point.to_u_px, point.to_v_px, track.patch_scale};
  if (!ok(anchor.patch.align(kernels_.present(), px_per_normalised * turn * anchor.normalised_per_px, position)))
    return false;
  track.patch_scale = position.scale;
  track.u_px = position.u_px;
  track.v_px = position.v_px;
  const double correction_px = exact::hypot(static_cast<double>(position.u_px - point.to_u_px),
                                            static_cast<double>(position.v_px - point.to_v_px));
  return static_cast<double>(position.similarity) >= options_.min_similarity &&
         correction_px <= options_.max_correction_px;
}

template <std::size_t MaxTracks, class Kernels>
bool FeatureTracker<MaxTracks, Kernels>::anchor(const Track& track) {
  Anchor& anchor = anchors_[track.slot];
  Vec2 pixel;
  Mat2 px_per_normalised;
  if (!ok(anchor.patch.capture(kernels_.present(), track.u_px, track.v_px))) return false;
  if (!ok(camera_.distort(track.normalised, pixel, px_per_normalised))) return false;
  anchor.ray_C = track.normalised.homogeneous();
  anchor.normalised_per_px = px_per_normalised.inverse();
  return true;
}

template <std::size_t MaxTracks, class Kernels>
void FeatureTracker<MaxTracks, Kernels>::reject_outliers(const MotionPrediction& motion) {
  matches_.clear();
  for (const Track& track : tracks_) (void)matches_.push_back({track.bearing_Cprev, track.bearing_C});
  const Quat* rotation = motion.valid ? &motion.q_CnowCprev : nullptr;
  const Status status = ransac_.reject({matches_.data(), matches_.size()}, rotation, outcome_);
  report_.outliers_judged = ok(status) && outcome_.judged;
  if (!report_.outliers_judged) return;
  for (std::size_t i = 0; i < tracks_.size(); ++i) tracks_[i].keep = outcome_.inlier[i];
  report_.lost_outlier = drop_unkept();
  // The rotation the matches agree on is free of gyro bias, which would otherwise add up over the life of a patch.
  const Quat correction = outcome_.q_C2C1 * motion.q_CnowCprev.conjugate();
  for (Track& track : tracks_) track.q_CCanchor = (correction * track.q_CCanchor).normalized();
}

// Two tracks on one feature would count its information twice; the older one stays. What is dropped is moved out of the
// way of the others, so that the distances are all that is looked at.
template <std::size_t MaxTracks, class Kernels>
void FeatureTracker<MaxTracks, Kernels>::drop_crowded() {
  constexpr float kAway_px = std::numeric_limits<float>::infinity();
  const float limit_px = static_cast<float>(tracker_detail::kCrowdedShare * options_.min_distance_px);
  std::array<float, MaxTracks> u_px;
  std::array<float, MaxTracks> v_px;
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    u_px[i] = tracks_[i].u_px;
    v_px[i] = tracks_[i].v_px;
    std::int32_t near = 0;
    for (std::size_t k = 0; k < i; ++k) {
      const float du = u_px[i] - u_px[k];
      const float dv = v_px[i] - v_px[k];
      near += du * du + dv * dv < limit_px * limit_px ? 1 : 0;
    }
    tracks_[i].keep = near == 0;
    if (near > 0) u_px[i] = kAway_px;
  }
  report_.lost_crowded = drop_unkept();
}

template <std::size_t MaxTracks, class Kernels>
std::uint32_t FeatureTracker<MaxTracks, Kernels>::drop_unkept() {
  const std::size_t before = tracks_.size();
  for (const Track& track : tracks_) {
    if (!track.keep) (void)free_slots_.push_back(track.slot);
  }
  tracks_.erase_if([](const Track& track) { return !track.keep; });
  return static_cast<std::uint32_t>(before - tracks_.size());
}

// Each gets the patch that is there, no corner needed: its alignment asks only for texture in both directions, which
// taking the patch checks. They come before corners and may exceed max_features; fewer corners are started for it
// later.
template <std::size_t MaxTracks, class Kernels>
void FeatureTracker<MaxTracks, Kernels>::start_wanted(const MotionPrediction& motion) {
  for (const Vec2& wanted : motion.wanted) {
    Vec2 pixel;
    if (tracks_.full() || !wanted.allFinite() || !ok(camera_.distort(wanted, pixel))) continue;
    if (!inside(pixel.x(), pixel.y()) || crowded(pixel)) continue;
    if (start_track({static_cast<float>(pixel.x()), static_cast<float>(pixel.y()), 0.0F})) ++report_.started_wanted;
  }
}

/// True where a new track would be dropped for running into an older one.
template <std::size_t MaxTracks, class Kernels>
bool FeatureTracker<MaxTracks, Kernels>::crowded(const Vec2& pixel) const {
  const double limit_px = tracker_detail::kCrowdedShare * options_.min_distance_px;
  for (const Track& track : tracks_) {
    const Vec2 other(static_cast<double>(track.u_px), static_cast<double>(track.v_px));
    if ((other - pixel).squaredNorm() < limit_px * limit_px) return true;
  }
  return false;
}

// In rounds, the emptiest tiles first, so that the last free tracks do not all go to the top of the image. A tile is
// searched when its turn comes, which for most does not before all tracks are given away.
template <std::size_t MaxTracks, class Kernels>
void FeatureTracker<MaxTracks, Kernels>::detect() {
  if (tracks_.size() >= static_cast<std::size_t>(options_.max_features)) return;
  const auto tile_count = static_cast<std::int32_t>(tiles_.size());
  const std::int32_t quota = (options_.max_features + tile_count - 1) / tile_count;
  tiles_.clear_counts();
  mask_.clear();
  for (const Track& track : tracks_) {
    tiles_.add(track.u_px, track.v_px);
    mask_.take(track.u_px, track.v_px);
  }
  searched_.fill(false);
  for (std::int32_t level = 1; level <= quota; ++level) {
    for (std::size_t tile = 0; tile < tiles_.size(); ++tile) {
      if (tracks_.size() >= static_cast<std::size_t>(options_.max_features)) return;
      if (tiles_.count(tile) < level) start_tracks(tile, level, quota);
    }
  }
}

template <std::size_t MaxTracks, class Kernels>
void FeatureTracker<MaxTracks, Kernels>::search_tile(std::size_t tile, std::int32_t wanted) {
  std::int32_t& threshold = fast_threshold_[tile];
  ++report_.searched_tiles;
  searched_[tile] = true;
  next_candidate_[tile] = 0;
  for (int pass = 0; pass < tracker_detail::kMaxSearchPasses; ++pass) {
    candidates_[tile].clear();
    CornerSink sink(mask_, candidates_[tile]);
    kernels_.detect(tiles_.rect(tile), threshold, sink);
    if (sink.offered() > tracker_detail::kManyCorners && threshold < options_.fast_threshold_max) {
      ++threshold;  // for the next image: fewer corners to sort through
    }
    if (candidates_[tile].size() >= static_cast<std::size_t>(wanted) || threshold <= options_.fast_threshold_min)
      return;
    threshold = threshold / 2 > options_.fast_threshold_min ? threshold / 2 : options_.fast_threshold_min;
  }
}

template <std::size_t MaxTracks, class Kernels>
void FeatureTracker<MaxTracks, Kernels>::start_tracks(std::size_t tile, std::int32_t level, std::int32_t quota) {
  if (!searched_[tile]) search_tile(tile, quota - tiles_.count(tile));
  const BestCorners<kCornersPerTile>& corners = candidates_[tile];
  while (tiles_.count(tile) < level && next_candidate_[tile] < corners.size()) {
    const Corner& corner = corners[next_candidate_[tile]++];
    if (mask_.is_taken(corner.u_px, corner.v_px)) continue;
    if (tracks_.size() >= static_cast<std::size_t>(options_.max_features)) return;
    start_track(corner);
  }
}

template <std::size_t MaxTracks, class Kernels>
bool FeatureTracker<MaxTracks, Kernels>::start_track(const Corner& corner) {
  Track track;
  track.u_px = corner.u_px;
  track.v_px = corner.v_px;
  mask_.take(corner.u_px, corner.v_px);
  if (!locate(track)) return false;  // seen through a part of the lens that the model does not cover
  track.slot = free_slots_.back();
  if (!anchor(track)) return false;
  free_slots_.pop_back();
  track.id = next_id_++;
  track.bearing_Cprev = track.bearing_C;
  tiles_.add(corner.u_px, corner.v_px);
  ++report_.started;
  return ok(tracks_.push_back(track));
}

template <std::size_t MaxTracks, class Kernels>
void FeatureTracker<MaxTracks, Kernels>::publish(const CameraFrame& frame, FeatureFrame<MaxTracks>& out) const {
  out.t = frame.t_exposure_mid;
  out.sequence = frame.sequence;
  out.observations.clear();
  for (const Track& track : tracks_) {
    (void)out.observations.push_back({track.id, track.u_px, track.v_px, track.normalised.x(), track.normalised.y()});
  }
}

template <std::size_t MaxTracks, class Kernels>
bool FeatureTracker<MaxTracks, Kernels>::locate(Track& track) const {
  const Vec2 pixel(static_cast<double>(track.u_px), static_cast<double>(track.v_px));
  if (!ok(camera_.undistort(pixel, track.normalised))) return false;
  track.bearing_C = track.normalised.homogeneous().normalized();
  return true;
}

template <std::size_t MaxTracks, class Kernels>
bool FeatureTracker<MaxTracks, Kernels>::inside(double u_px, double v_px) const {
  const double border_px = options_.border_px;
  return u_px >= border_px && v_px >= border_px && u_px <= camera_.calibration().width - 1 - border_px &&
         v_px <= camera_.calibration().height - 1 - border_px;
}

}  // namespace plumb
