#pragma once
// Is the vehicle standing still? Only when the IMU and the images say so together: a smooth climb looks still to the
// IMU, a hover over far ground to the camera.

#include <algorithm>

#include "fsw/estimator/imu_buffer.h"
#include "fsw/estimator/options.h"
#include "fsw/vision/feature_frame.h"

namespace plumb {

/// True when the IMU shows neither rotation nor acceleration beyond noise over [from, to].
bool imu_is_still(const ImuBuffer& imu, Time from, Time to, const StartOptions& options, double gravity_m_s2);

/// Compares each image with a reference image at least one still_window older.
template <std::size_t MaxTracks>
class ImageStillness {
 public:
  void clear() { has_reference_ = false; }

  /// True when the median feature has stayed within limit_normalised of where the reference image had it, for
  /// window_s or longer.
  bool update(const FeatureFrame<MaxTracks>& frame, double limit_normalised, double window_s) {
    constexpr std::size_t kMinCommon = 8;
    constexpr double kRenewAfterWindows = 4.0;  // a slow drift must add up before the reference is renewed
    const std::size_t common = has_reference_ ? compare(frame) : 0;
    const double age_s = has_reference_ ? (frame.t - reference_.t).seconds() : 0.0;
    const bool moved = common < kMinCommon || median(common) > limit_normalised;
    const bool still = !moved && age_s >= window_s;
    if (moved || age_s >= kRenewAfterWindows * window_s) {
      was_still_ = still;
      reference_ = frame;
      has_reference_ = true;
      return still;
    }
    // Just after a renewal the new reference is young; what was still before stays so until it moves.
    was_still_ = still || was_still_;
    return was_still_;
  }

 private:
  std::size_t compare(const FeatureFrame<MaxTracks>& frame) {
    std::size_t count = 0;
    std::size_t r = 0;
    for (const FeatureObservation& now : frame.observations) {
      while (r < reference_.observations.size() && reference_.observations[r].track_id < now.track_id) ++r;
      if (r == reference_.observations.size()) break;
      const FeatureObservation& then = reference_.observations[r];
      if (then.track_id != now.track_id) continue;
      displacement_[count++] = (Vec2(now.x, now.y) - Vec2(then.x, then.y)).norm();
    }
    return count;
  }
  double median(std::size_t count) {
    std::nth_element(displacement_.begin(), displacement_.begin() + static_cast<std::ptrdiff_t>(count / 2),
                     displacement_.begin() + static_cast<std::ptrdiff_t>(count));
    return displacement_[count / 2];
  }

  FeatureFrame<MaxTracks> reference_;
  std::array<double, MaxTracks> displacement_{};
  bool has_reference_ = false;
  bool was_still_ = false;
};

}  // namespace plumb
