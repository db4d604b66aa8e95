#pragma once
// The simulated front end behind the flight interface. It looks at the time stamp of the frame, never at its pixels.

#include "fsw/vision/tracker.h"
#include "test/support/sim/landmark_tracker.h"
#include "test/support/sim/trajectory.h"

namespace plumb::sim {

template <std::size_t MaxTracks>
class SimTracker : public Tracker<MaxTracks> {
 public:
  /// Trajectory, world and rig must outlive the tracker. `epoch` is the flight clock at the trajectory's zero.
  SimTracker(const TrackerOptions& options, const Trajectory& trajectory, const World& world, const Rig& rig,
             Time epoch, std::uint64_t seed)
      : trajectory_(trajectory), epoch_(epoch), landmarks_(options, world, rig, seed) {
    PLUMB_ASSERT(options.target_tracks <= static_cast<int>(MaxTracks));
  }

  Status track(const CameraFrame& frame, const MotionPrediction& motion, FeatureFrame<MaxTracks>& out) override {
    if (frame.t_exposure_mid <= last_t_) return Status::kOutOfOrder;
    last_t_ = frame.t_exposure_mid;
    out.t = frame.t_exposure_mid;
    out.sequence = frame.sequence;
    out.observations.clear();
    for (const FeatureObservation& observation :
         landmarks_.observe(trajectory_.at((frame.t_exposure_mid - epoch_).seconds()),
                            {motion.wanted.data(), motion.wanted.size()}, MaxTracks)) {
      PLUMB_ASSERT(ok(out.observations.push_back(observation)));
    }
    return Status::kOk;
  }

  void use(const plumb::TrackerOptions&) override {}
  void reset() override {
    landmarks_.reset();
    last_t_ = Time::never();
  }

  const LandmarkTracker& landmarks() const { return landmarks_; }

 private:
  const Trajectory& trajectory_;
  Time epoch_;
  Time last_t_ = Time::never();
  LandmarkTracker landmarks_;
};

}  // namespace plumb::sim
