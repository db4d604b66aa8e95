#pragma once
// The error state and where each part of it stands.
//
// The filter carries the right-invariant error: for every pose in the state, the IMU's and each camera's in the window,
//
//     R = Exp(theta) R_hat        p = Exp(theta) p_hat + xi_p        v = Exp(theta) v_hat + xi_v
//
// with theta and xi in W. Biases and features (alpha, beta, rho) have additive errors. Under this choice the directions
// that no sensor can observe, a common translation and a common turn about gravity, are the same constant vectors at
// every estimate: xi_p = t for all poses, and theta = e_z for all poses. Each Jacobian, evaluated at the best estimate,
// keeps them in its null space, so no first-estimate bookkeeping is needed and no false heading information appears.
// A camera pose cloned from the IMU has the very same (theta, xi_p), so cloning copies rows and columns, and adds what
// calibration errors do to the pose where those are estimated.
// See docs/decisions.md; the published covariance is converted to the local convention of nav_state.h.

#include <cstddef>
#include <cstdint>

#include "fsw/base/fixed_vector.h"
#include "fsw/base/mission_config.h"
#include "fsw/math/so3.h"

namespace plumb {

inline constexpr std::size_t kTheta = 0;       ///< attitude error of I in W, rad
inline constexpr std::size_t kXiP = 3;         ///< position error, m
inline constexpr std::size_t kXiV = 6;         ///< velocity error, m/s
inline constexpr std::size_t kGyroBias = 9;    ///< rad/s
inline constexpr std::size_t kAccelBias = 12;  ///< m/s^2
inline constexpr std::size_t kCoreSize = 15;
inline constexpr std::size_t kPoseSize = 6;     ///< theta, xi_p of one camera pose
inline constexpr std::size_t kFeatureSize = 3;  ///< alpha, beta, rho

using Mat15 = Eigen::Matrix<double, 15, 15, Eigen::RowMajor>;
using Row5 = Eigen::Matrix<double, 1, 5>;
using Row6 = Eigen::Matrix<double, 1, 6>;
using Mat26 = Eigen::Matrix<double, 2, 6, Eigen::RowMajor>;
using Mat23 = Eigen::Matrix<double, 2, 3, Eigen::RowMajor>;

/// Calibration errors (calibration.h), each block in this order: gyro scale (3), accelerometer scale (3); image time
/// offset, s, camera rotation in I, rad (3), camera position in I, m (3); tilt of the beam, rad (2), its origin in C,
/// m (3).
inline constexpr std::size_t kImuScaleSize = 6;
inline constexpr std::size_t kCameraMountSize = 7;
inline constexpr std::size_t kBeamSize = 5;

/// Offsets for one mission configuration: core, calibration, then the window's pose slots, then the features.
template <class Config>
struct ErrorLayout {
  static constexpr CalibrationBlocks kBlocks = Config::kCalibration;
  static constexpr std::size_t kImuScale = kCoreSize;
  static constexpr std::size_t kCameraMount = kImuScale + (kBlocks.imu_scale ? kImuScaleSize : 0);
  static constexpr std::size_t kBeam = kCameraMount + (kBlocks.camera ? kCameraMountSize : 0);
  static constexpr std::size_t kPoses = kBeam + (kBlocks.range_finder ? kBeamSize : 0);
  static constexpr std::size_t kCalibrationSize = kPoses - kCoreSize;
  static constexpr std::size_t kFeatures = kPoses + kPoseSize * Config::kMaxPoses;
  static constexpr std::size_t kSize = kFeatures + kFeatureSize * Config::kMaxSlamFeatures;
  static constexpr std::size_t pose(std::size_t slot) { return kPoses + kPoseSize * slot; }
  static constexpr std::size_t feature(std::size_t index) { return kFeatures + kFeatureSize * index; }
};

/// A run of non-zero columns in a row of a Jacobian.
struct Segment {
  std::size_t start = 0;
  std::size_t length = 0;
};
/// Enough for the widest row there is, the ranged facet: IMU, calibration, three anchors, three features.
using Support = FixedVector<Segment, 8>;

}  // namespace plumb
