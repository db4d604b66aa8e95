#pragma once
// A feature track seen by the poses of a window.

#include <gtest/gtest.h>

#include "fsw/estimator/track_rows.h"
#include "test/support/estimator_cases.h"

namespace plumb::test {

inline constexpr std::size_t kTrackPoses = 8;
inline constexpr double kSigma = 0.00125;  ///< of an observation, normalised image plane
using TrackCaseRows = TrackRows<kTrackPoses>;

struct TrackCase {
  Views views;
  TriangulationLimits limits;
  Vec3 point = Vec3::Zero();
};

/// A track of 3 to 8 views by poses that stand in any order in the window's slots.
inline TrackCase any_track(Generator& g, double noise) {
  TrackCase c;
  c.limits.min_parallax = 0.002;
  c.limits.max_rms = 1.0;
  const auto length = static_cast<std::size_t>(g.integer(3, kTrackPoses));
  const auto first_slot = static_cast<std::size_t>(g.integer(0, kTrackPoses - 1));
  c.point = any_ground_point(g);
  const SensorCalibration calibration = nadir_calibration();
  for (std::size_t i = 0; i < length; ++i) {
    View view;
    view.camera = camera_of(core_over_ground(g, i), calibration);
    view.z = feature_of(view.camera, c.point).head<2>() + g.normal_vector<2>(noise);
    view.pose_slot = (first_slot + i) % kTrackPoses;
    EXPECT_EQ(c.views.push_back(view), Status::kOk);
  }
  return c;
}

}  // namespace plumb::test
