#pragma once
// The front end behind one interface, so that flight, the OpenCV oracle and the simulation are interchangeable.

#include "fsw/base/fixed_vector.h"
#include "fsw/base/status.h"
#include "fsw/math/so3.h"
#include "fsw/measurement/samples.h"
#include "fsw/vision/feature_frame.h"
#include "fsw/vision/tracker_options.h"

namespace plumb {

/// Features that may be asked for in one image: a range finder faster than the camera has several ranges per image.
inline constexpr std::size_t kMaxWantedFeatures = 4;

/// What the IMU says of the motion since the last tracked image, to seed the search, and where features are wanted.
struct MotionPrediction {
  bool valid = false;                   ///< false: no usable IMU between the images; search around the old positions
  Quat q_CnowCprev = Quat::Identity();  ///< rotates vectors from the previous camera frame into the present one
  /// Points of the present image (normalised image plane) where the filter has a use for a feature: the laser's spots.
  /// A tracker starts one exactly there, closer to others than it would start a corner, if there is none already and
  /// the texture allows following it; a corner nearby is no substitute, because over an edge it has another depth.
  FixedVector<Vec2, kMaxWantedFeatures> wanted{};
};

template <std::size_t MaxTracks>
class Tracker {
 public:
  /// Follows every live track into the frame, drops the bad ones, starts new ones, and reports all that are alive.
  /// Fails only on a malformed frame (kInvalidValue) or a stamp not after the last one (kOutOfOrder); the tracker then
  /// keeps its state. An image without texture is not a failure: `out` is then empty.
  [[nodiscard]] virtual Status track(const CameraFrame& frame, const MotionPrediction& motion,
                                     FeatureFrame<MaxTracks>& out) = 0;
  /// Other options from the next image on, of those that may be changed in flight.
  virtual void use(const TrackerOptions& options) = 0;
  /// Forgets every track and image. Track ids go on counting, so none is ever used twice.
  virtual void reset() = 0;

 protected:
  // Nobody owns one through this interface, and a virtual destructor would pull operator delete into flight code.
  ~Tracker() = default;
};

}  // namespace plumb
