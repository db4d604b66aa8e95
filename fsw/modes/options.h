#pragma once
// Run-time settings of modes and health. Names, units and ranges stand in the parameter table (fsw/app/parameters.cpp).

namespace plumb {

struct ModeOptions {
  double image_timeout_s = 0.5;  ///< without an image of use for longer, the state rests on the IMU alone
  /// Without a range of use for longer, nothing holds the scale. Longer than RangeOptions::facet_after_s, for which
  /// ranges are spared while the tracks that have one are not of use yet.
  double range_timeout_s = 1.5;
  double imu_timeout_s = 0.2;     ///< without a sample for longer, there is no navigation
  double start_time_s = 10.0;     ///< but after power-up the IMU has so long to say something
  double steady_s = 0.5;          ///< of samples without a hole, after which an IMU that was away counts again
  int max_resets = 3;             ///< so many resets of the filter's own accord
  double reset_window_s = 10.0;   ///< within this time are a failure
  double fault_recovery_s = 5.0;  ///< after a numerical fault, to have a state again

  int rejected_after = 10;   ///< samples refused in a row, after which a sensor counts as rejected
  int degraded_after = 3;    ///< and as degraded
  int restored_after = 5;    ///< samples accepted in a row, after which it counts as sound again
  double poor_share = 0.25;  ///< of the samples of one second refused: degraded
  double poor_rate = 0.5;    ///< of the best rate so far: a sensor that is slower is degraded

  double position_sigma_limit_m = 1.0;  ///< 1 sigma of an axis: a state that is worse is not reliable
  double velocity_sigma_limit_m_s = 0.5;
  double horizon_s = 30.0;  ///< longest time for which reliability is foretold
};

}  // namespace plumb
