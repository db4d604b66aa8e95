#pragma once
// Is the vehicle standing still? Only when the IMU and the images say so together: a smooth climb looks still to the
// IMU, a hover over far ground to the camera.

#include <algorithm>
#include <array>
#include <limits>

#include "fsw/estimator/imu_buffer.h"
#include "fsw/estimator/options.h"
#include "fsw/vision/feature_frame.h"

namespace plumb {

/// True when the IMU shows neither rotation nor acceleration beyond its noise over [from, to].
bool imu_is_still(const ImuBuffer& imu, Time from, Time to, const EstimatorOptions& options);

/// One feature in two images, normalised image plane.
struct Displacement {
  Vec2 from = Vec2::Zero();
  Vec2 by = Vec2::Zero();
};

/// Root mean square, over the image, of the affine flow field that fits the displacements best. Shift, turn, approach
/// and shear of the image all show in it, while the noise of single features averages out. Over the image and not over
/// the features: huddled together they hardly move in a climb, and what they say of the rest of the image is noise that
/// must show. Features that move against the rest are left out of a second fit. `half_size` is half the width and
/// height of the image in the normalised plane. Infinite when the points do not determine a field.
double smooth_flow_rms(const Displacement* displacements, std::size_t count, const Vec2& half_size);

/// What the images say about standing still.
struct ImageEvidence {
  bool still = false;
  double max_flow_per_s = 0.0;  ///< no image motion faster than this (normalised plane) escaped notice
};

/// Compares each image with a reference image at least one still_window older.
template <std::size_t MaxTracks>
class ImageStillness {
 public:
  ImageStillness(const StartOptions& options, const SensorCalibration& calibration)
      : focal_px_(calibration.focal_px), half_size_(calibration.half_fov_x, calibration.half_fov_y) {
    use(options);
  }
  /// Other options from the next image on.
  void use(const StartOptions& options) {
    limit_ = options.still_image_px / focal_px_;
    window_s_ = options.still_window_s;
  }

  void clear() {
    has_reference_ = false;
    evidence_ = {};
  }

  /// Still: the image has stayed within still_image_px of the reference image for still_window_s or longer.
  ImageEvidence update(const FeatureFrame<MaxTracks>& frame) {
    constexpr std::size_t kMinCommon = 8;
    constexpr double kRenewAfterWindows = 4.0;  // a slow drift must add up before the reference is renewed
    constexpr double kFlowFloor = 0.2;          // of the limit: what tracking errors can hide
    const std::size_t common = has_reference_ ? compare(frame) : 0;
    const double age_s = has_reference_ ? (frame.t - reference_.t).seconds() : 0.0;
    const double flow = common < kMinCommon ? std::numeric_limits<double>::infinity()
                                            : smooth_flow_rms(displacements_.data(), common, half_size_);
    const bool moved = flow > limit_;
    const bool long_enough = age_s >= window_s_;
    // Just after a renewal the new reference is young; what was still before stays so until it moves.
    evidence_.still = !moved && (evidence_.still || long_enough);
    if (!moved && long_enough) evidence_.max_flow_per_s = std::max(flow, kFlowFloor * limit_) / age_s;
    if (moved || age_s >= kRenewAfterWindows * window_s_) {
      reference_ = frame;
      has_reference_ = true;
    }
    return evidence_;
  }

  /// Adds all that the next update() depends on to a hash.
  void add_to(Hash64& hash) const {
    hash.add(std::uint64_t{evidence_.still ? 1U : 0U});
    hash.add(evidence_.max_flow_per_s);
    hash.add(std::uint64_t{has_reference_ ? 1U : 0U});
    if (!has_reference_) return;
    hash.add(static_cast<std::uint64_t>(reference_.t.ns()));
    for (const FeatureObservation& seen : reference_.observations) {
      hash.add(std::uint64_t{seen.track_id});
      hash.add(seen.x);
      hash.add(seen.y);
    }
  }

 private:
  /// Both frames are in order of id.
  std::size_t compare(const FeatureFrame<MaxTracks>& frame) {
    std::size_t count = 0;
    std::size_t r = 0;
    for (const FeatureObservation& now : frame.observations) {
      while (r < reference_.observations.size() && reference_.observations[r].track_id < now.track_id) ++r;
      if (r == reference_.observations.size()) break;
      const FeatureObservation& then = reference_.observations[r];
      if (then.track_id != now.track_id) continue;
      displacements_[count++] = {Vec2(then.x, then.y), Vec2(now.x - then.x, now.y - then.y)};
    }
    return count;
  }

  double focal_px_;
  double limit_ = 0.0;     ///< of motion, normalised image plane
  double window_s_ = 0.0;  ///< to be still for
  Vec2 half_size_;         ///< of the image, normalised
  FeatureFrame<MaxTracks> reference_;
  std::array<Displacement, MaxTracks> displacements_{};
  bool has_reference_ = false;
  ImageEvidence evidence_;
};

}  // namespace plumb
