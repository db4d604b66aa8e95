#pragma once
// Calibration that the filter may estimate: the offset between image and IMU stamps, where the camera sits on the IMU,
// where the range finder's beam starts and points. (Scale factors of the IMU are in CoreState.) What is not estimated
// stays as the calibration file says.
//
// Errors: time offset additive; R_IC = Exp(phi) R_IC_hat with phi in I; camera position additive in I; the beam is
// u = normalised(u_file + N tilt), N two unit normals of the file's beam, tilt additive; its origin additive in C.

#include <array>

#include "fsw/base/time.h"
#include "fsw/estimator/error_state.h"
#include "fsw/estimator/options.h"
#include "fsw/estimator/propagation.h"
#include "fsw/estimator/triangulation.h"
#include "fsw/vision/track_table.h"

namespace plumb {

/// An offset beyond this is no calibration any more.
inline constexpr double kMaxTimeOffset_s = 0.2;

/// d (theta, xi_p) of a camera pose / d (time offset, phi, camera position).
using Mat67 = Eigen::Matrix<double, 6, 7, Eigen::RowMajor>;
using Mat32 = Eigen::Matrix<double, 3, 2>;

class CalibrationState {
 public:
  CalibrationState() = default;
  explicit CalibrationState(const SensorCalibration& file);

  const SensorCalibration& sensors() const { return sensors_; }
  /// On the IMU's clock an image was taken this much after its stamp.
  double time_offset_s() const { return time_offset_s_; }
  /// The time on the IMU's clock of an image with this stamp.
  Time imu_time(Time stamp) const { return stamp + Duration::from_seconds(time_offset_s_); }

  /// Moves offset and mounting of the camera by an error of 7 elements, laid out as in error_state.h.
  void retract_camera(const double* error);
  /// Moves the beam by an error of 5 elements.
  void retract_beam(const double* error);

  CameraPose camera(const KinematicState& motion) const {
    return {(motion.q_WI * sensors_.q_IC).toRotationMatrix(), motion.p_WI_m + motion.q_WI * sensors_.p_IC_m};
  }
  /// What the camera's calibration errors do to the pose of the camera, on an IMU that turns with rate_I_rad_s.
  Mat67 camera_by_mount(const KinematicState& motion, const Vec3& rate_I_rad_s) const;
  /// d u_C / d tilt.
  Mat32 beam_by_tilt() const;
  /// The inverse depth of a ranged track with the beam as it is known now, and its Jacobian on the beam's error.
  void correct(const RangeRay& ray, KnownDepth& known) const;

  bool finite() const;
  /// Differences from the calibration file, camera (7) then beam (5), laid out as in error_state.h.
  std::array<double, kCameraMountSize + kBeamSize> difference_from_file() const;

 private:
  SensorCalibration file_;
  SensorCalibration sensors_;
  double time_offset_s_ = 0.0;
  Vec2 tilt_ = Vec2::Zero();
  Mat32 normals_C_ = Mat32::Zero();
};

}  // namespace plumb
