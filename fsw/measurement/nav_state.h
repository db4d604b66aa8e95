#pragma once
// The navigation state: what Plumb is for. A plain record, so that it can be logged, hashed and published as it stands.

#include <array>
#include <cstddef>
#include <cstdint>

#include "fsw/base/time.h"

namespace plumb {

/// What the navigation solution rests on at this moment.
enum class NavMode : std::uint8_t {
  kInitialising = 0,  ///< no state yet
  kRangeVio,          ///< camera, IMU and range
  kVio,               ///< camera and IMU: scale is not held at constant velocity
  kInertial,          ///< IMU alone: drifts within seconds
  kFailed,            ///< no IMU, or a filter that does not recover: whatever is there is of no use
};

/// Whether a state may be acted on. Decided beside the estimator (fsw/modes), never by it.
struct NavStatus {
  bool valid = false;
  NavMode mode = NavMode::kInitialising;
  double reliable_for_s = 0.0;  ///< without further aiding: until it is worse than the limits of modes.*
};

inline constexpr std::size_t kNavErrorSize = 15;

/// Offsets into the 15-vector of errors and its covariance: p [m], v [m/s], attitude [rad], gyro bias, accel bias.
/// Position and velocity errors are additive in W; the attitude error is local, R = R_hat Exp(dtheta).
inline constexpr std::size_t kNavPosition = 0;
inline constexpr std::size_t kNavVelocity = 3;
inline constexpr std::size_t kNavAttitude = 6;
inline constexpr std::size_t kNavGyroBias = 9;
inline constexpr std::size_t kNavAccelBias = 12;

struct NavState {
  Time t;
  bool valid = false;             ///< false: every number below is meaningless
  Time t_vision = Time::never();  ///< newest image that held it, by its features or by showing a standstill
  Time t_range = Time::never();   ///< newest range that did
  bool heading_known = false;     ///< W has x east, y north; false: its heading is that of the start
  std::uint32_t reset_count = 0;  ///< re-initialisations since start-up; position and yaw start anew at each

  std::array<double, 3> p_WI_m{};          ///< origin of I in W
  std::array<double, 3> v_WI_m_s{};        ///< its velocity in W
  std::array<double, 4> q_WI{1, 0, 0, 0};  ///< w x y z, Hamilton, rotates from I to W
  std::array<double, 3> b_gyro_rad_s{};
  std::array<double, 3> b_accel_m_s2{};
  std::array<double, 3> gyro_scale{};  ///< IMU readings are to be multiplied by 1 + scale before the bias is taken off
  std::array<double, 3> accel_scale{};
  std::array<double, kNavErrorSize * kNavErrorSize> covariance{};  ///< row-major, SI units
};

}  // namespace plumb
