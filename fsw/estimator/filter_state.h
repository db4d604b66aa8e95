#pragma once
// The state of the filter: IMU core, sliding window of camera poses, features, and the one covariance.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "fsw/base/hash.h"
#include "fsw/base/time.h"
#include "fsw/estimator/calibration.h"
#include "fsw/estimator/covariance.h"
#include "fsw/estimator/propagation.h"
#include "fsw/estimator/report.h"
#include "fsw/estimator/visual_model.h"

namespace plumb {

/// A cloned camera pose; `sequence` is that of its image.
struct WindowPose {
  std::uint32_t sequence = 0;
  Quat q_WC = Quat::Identity();
  CameraPose camera;
};

struct SlamFeature {
  std::uint32_t track_id = 0;
  std::size_t anchor_slot = 0;
  FeatureParameters parameters = FeatureParameters::Zero();
  int consecutive_rejections = 0;
  bool ranged = false;           ///< it started from a ranged track
  int ranges_missed = 0;         ///< ranges in a row that contradict it
  Time t_range = Time::never();  ///< of the last that held it, where its depth is a range's alone
};

template <class Config>
class FilterState {
 public:
  using Layout = ErrorLayout<Config>;

  Time t;
  CoreState core;
  FixedVector<SlamFeature, Config::kMaxSlamFeatures> features;

  /// Everything forgotten but the calibration as it stands, which counts as known from now on; covariance zero.
  void clear() {
    t = Time::never();
    core = {};
    features.clear();
    window_.clear();
    covariance_.clear();
    estimated_ = {};
  }

  /// Calibration as in the file, with these uncertainties; those of blocks that the configuration lacks are ignored.
  void set_calibration(const SensorCalibration& file, const CalibrationOptions& sigmas);
  const CalibrationState& calibration() const { return calibration_; }
  bool estimates_scale() const {
    return Layout::kBlocks.imu_scale && estimates(Layout::kImuScale, Layout::kCameraMount);
  }
  bool estimates_camera() const { return Layout::kBlocks.camera && estimates(Layout::kCameraMount, Layout::kBeam); }
  bool estimates_beam() const { return Layout::kBlocks.range_finder && estimates(Layout::kBeam, Layout::kPoses); }
  CalibrationReport calibration_report() const;

  /// Active states: core, every pose slot (used or not), features present.
  std::size_t size() const { return Layout::feature(features.size()); }
  MatrixView covariance() { return covariance_.view(size(), size()); }
  ConstMatrixView covariance() const { return covariance_.view().block(0, 0, size(), size()); }

  /// Pose slots in use, oldest first.
  const FixedVector<std::size_t, Config::kMaxPoses>& window() const { return window_; }
  const WindowPose& pose(std::size_t slot) const { return poses_[slot]; }
  const WindowPose& newest() const { return poses_[window_.back()]; }
  /// Slot of the pose of that image, or kMaxPoses when it is not in the window.
  std::size_t slot_of(std::uint32_t sequence) const {
    for (std::size_t slot : window_) {
      if (poses_[slot].sequence == sequence) return slot;
    }
    return Config::kMaxPoses;
  }

  /// Drops the i-th oldest pose. Features anchored there move to the newest other pose first; one that cannot is
  /// removed.
  void drop_pose(std::size_t i);
  /// Appends the present camera pose. Precondition: the window has a free slot. `rate_I_rad_s`: how I turns at this
  /// moment, which the time offset of the image needs.
  void clone_camera(std::uint32_t sequence, const Vec3& rate_I_rad_s = Vec3::Zero());
  /// Appends a feature without correlation to anything. kFull when there is no slot.
  Status add_feature(const SlamFeature& feature, const Mat3& covariance);
  /// Appends a feature whose error is J x + w, w of covariance `noise`; J is 3 x size().
  Status add_feature(const SlamFeature& feature, ConstMatrixView jacobian, const Support& support, const Mat3& noise);
  /// The last feature takes the freed place.
  void remove_feature(std::size_t i);

  /// Moves the origin of the world to where I is now, as far as that may be from where it was. Precondition: no poses
  /// or features yet. `sigma_m`: what "zero" uncertainty is.
  void begin_world_here(double sigma_m);
  /// Turns the world about the vertical through its origin, and makes its heading uncertain by `sigma_rad` more: an
  /// error common to all poses, to which everything that Plumb measures but known directions is blind.
  void turn_world(double yaw_rad, double sigma_rad);

  /// Moves the state by an error vector of size() elements.
  void retract(const double* dx);

  /// False when any number is not finite or any variance not positive.
  bool healthy() const;
  std::uint64_t hash() const;

 private:
  bool reanchor(SlamFeature& feature, std::size_t index, std::size_t slot);
  /// Whether any of these calibration states is estimated.
  bool estimates(std::size_t from, std::size_t to) const {
    return std::any_of(estimated_.begin() + (from - kCoreSize), estimated_.begin() + (to - kCoreSize),
                       [](bool e) { return e; });
  }

  CalibrationState calibration_;
  std::array<bool, Layout::kCalibrationSize> estimated_{};  ///< of the calibration states; the others stay as they are
  std::array<WindowPose, Config::kMaxPoses> poses_;
  FixedVector<std::size_t, Config::kMaxPoses> window_;
  MatrixStorage<Layout::kSize, Layout::kSize> covariance_;
};

}  // namespace plumb

#include "fsw/estimator/filter_state.inl"
