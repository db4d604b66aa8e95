#pragma once
// Run-time settings of the estimator. Defaults are the shipped ones; names, units and ranges stand in the parameter
// table (fsw/app/parameters.cpp).

#include "fsw/math/so3.h"

namespace plumb {

/// Where the sensors sit. Filled from calibration files, never from defaults in flight.
struct SensorCalibration {
  Quat q_IC = Quat::Identity();  ///< rotates from camera C to IMU I
  Vec3 p_IC_m = Vec3::Zero();    ///< camera origin in I
  Vec3 p_CR_m = Vec3::Zero();    ///< range finder origin in C
  Vec3 u_C = Vec3::UnitZ();      ///< beam direction in C, unit length
  double focal_px = 0.0;         ///< converts pixel noise to the normalised plane
  double half_fov_x = 0.0;       ///< half width of the image in the normalised plane: tiles are laid over it
  double half_fov_y = 0.0;

  /// Where the beam ends, in C.
  Vec3 impact_C_m(double range_m) const { return p_CR_m + range_m * u_C; }
};

struct ImuOptions {
  double gyro_noise_density = 2.0e-4;   ///< rad/s/sqrt(Hz)
  double gyro_bias_walk = 2.0e-5;       ///< rad/s^2/sqrt(Hz)
  double gyro_scale_error = 5.0e-4;     ///< of the rate, 1 sigma: scale factors and misaligned axes
  double accel_noise_density = 2.0e-3;  ///< m/s^2/sqrt(Hz)
  double accel_bias_walk = 3.0e-3;      ///< m/s^3/sqrt(Hz)
  double gravity_m_s2 = 9.80665;
  /// A longer hole in the IMU stream is a fault: re-initialise. A shorter one costs what the rates may have been in it;
  /// over 0.15 s that is an attitude too unsure to linearise around.
  double max_gap_s = 0.12;
  double max_accel_m_s2 = 160.0;  ///< scale of an axis: at its end a reading is clipped, beyond it a fault, not used
  double max_gyro_rad_s = 35.0;
};

struct VisionOptions {
  double pixel_noise_px = 0.35;     ///< 1 sigma of a tracked feature, its drift from image to image included
  int pixel_noise_images = 0;       ///< images over which the noise follows the innovations; 0: it stays
  double pixel_noise_min_px = 0.3;  ///< and the limits it keeps to
  double pixel_noise_max_px = 3.0;
  double gate_probability = 0.99;       ///< chi-square gate of visual rows
  double min_parallax_px = 6.0;         ///< rotation-free track extent needed to triangulate
  double ranged_min_parallax_px = 1.0;  ///< the same for a track with a range: enough to tell a false echo
  double min_depth_m = 0.2;             ///< semi-infinite start: rho0 = 1/(2 d_min)
  double max_depth_m = 300.0;           ///< beyond this a triangulated feature is not used
  int min_track_length = 4;             ///< observations an ended track must have to be used
  double pose_interval_s = 0.035;       ///< between poses that stay in the window; one that comes sooner is replaced
  int max_rejections = 3;               ///< consecutive gate failures that a SLAM feature survives
  double slam_velocity_sigma = 0.02;    ///< of the velocity, 1 sigma: above it features wait for the scale
  int tiles_x = 4;                      ///< SLAM features are spread over tiles_x x tiles_y
  int tiles_y = 3;
  int spot_features = 0;  ///< but as many as this go where the laser's spot is, before others
};

struct RangeOptions {
  bool enabled = true;
  double noise_m = 0.05;  ///< 1 sigma of the device
  double min_range_m = 0.1;
  double max_range_m = 40.0;
  double gate_sigma = 2.0;          ///< Mahalanobis gate, the paper's value
  double max_age_s = 0.1;           ///< older than this against the horizon: stale
  double max_incidence_deg = 75.0;  ///< between the beam and the facet's normal
  double max_facet_edge = 0.6;      ///< longest edge in the normalised image plane
  bool feature = true;              ///< give ranges to the tracks at the laser's spot
  bool facet = true;                ///< compare ranges with the facet under them
  double facet_after_s = 1.0;       ///< but only when no ranged track was of use for so long; 0: whenever none took it
  bool relief = true;               ///< what features tell of the ground goes into the noise of a facet
  bool depth_prior = true;          ///< new features are taken to be as far as the last range
  int max_features = 10;            ///< SLAM features that may be ranged ones
  double feature_slope = 0.5;       ///< of the ground under a ranged feature, for what its distance to the spot costs
};

/// Longest window that a standstill or a start in motion can be judged on: the IMU samples behind the newest image are
/// kept for little longer.
inline constexpr double kMaxStartWindow_s = 2.0;

/// Known directions that the heading is held by. 0: the sensor is not used.
struct DirectionOptions {
  double sun_noise_rad = 0.0;           ///< 1 sigma per axis across the direction
  double magnetometer_noise_rad = 0.0;  ///< 1 sigma of the field's direction, across it
  double gate_probability = 0.999;      ///< chi-square gate
};

struct StartOptions {
  double gyro_bias_sigma_rad_s = 0.05;  ///< turn-on bias of the hardware
  double accel_bias_sigma_m_s2 = 0.15;
  double still_gyro_rad_s = 0.02;  ///< IMU counts as still below these standard deviations
  double still_accel_m_s2 = 0.15;
  double still_image_px = 0.5;  ///< and the image moves less than this over the window
  double still_window_s = 0.5;
  bool in_motion = true;             ///< else only a standstill starts the filter
  double motion_window_s = 0.5;      ///< shortest span an in-motion start is tried on
  double motion_window_max_s = 1.5;  ///< longest: then ranges start it with the uncertainty it has
};

/// What the sensors' calibration is uncertain by, 1 sigma per axis. 0: taken as it stands. Of use only in mission
/// configurations that have room for the states (CalibrationBlocks).
struct CalibrationOptions {
  double time_offset_sigma_s = 0.0;        ///< of image stamps against the IMU's
  double camera_rotation_sigma_rad = 0.0;  ///< of the camera in I
  double camera_position_sigma_m = 0.0;
  double beam_tilt_sigma_rad = 0.0;  ///< of the range finder's beam in C
  double beam_origin_sigma_m = 0.0;
  double gyro_scale_sigma = 0.0;
  double accel_scale_sigma = 0.0;
};

struct EstimatorOptions {
  ImuOptions imu;
  VisionOptions vision;
  RangeOptions range;
  DirectionOptions direction;
  StartOptions start;
  CalibrationOptions calibration;
};

}  // namespace plumb
