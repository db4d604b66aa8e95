#include "fsw/app/parameters.h"

#include <algorithm>
#include <array>

#include "fsw/base/mission_config.h"
#include "fsw/modes/mode_machine.h"

namespace plumb {
namespace {

using Row = ParamRow<Parameters>;
using Text = std::string_view;
using enum ParamChange;

template <auto Member>
consteval Row imu(Text name, Text unit, double min, double max, ParamChange change, Text description) {
  return param<Parameters, &Parameters::estimator, &EstimatorOptions::imu, Member>(name, unit, min, max, description,
                                                                                   change);
}
template <auto Member>
consteval Row vision(Text name, Text unit, double min, double max, ParamChange change, Text description) {
  return param<Parameters, &Parameters::estimator, &EstimatorOptions::vision, Member>(name, unit, min, max, description,
                                                                                      change);
}
template <auto Member>
consteval Row range(Text name, Text unit, double min, double max, ParamChange change, Text description) {
  return param<Parameters, &Parameters::estimator, &EstimatorOptions::range, Member>(name, unit, min, max, description,
                                                                                     change);
}
template <auto Member>
consteval Row direction(Text name, Text unit, double min, double max, ParamChange change, Text description) {
  return param<Parameters, &Parameters::estimator, &EstimatorOptions::direction, Member>(name, unit, min, max,
                                                                                         description, change);
}
template <auto Member>
consteval Row start(Text name, Text unit, double min, double max, ParamChange change, Text description) {
  return param<Parameters, &Parameters::estimator, &EstimatorOptions::start, Member>(name, unit, min, max, description,
                                                                                     change);
}
template <auto Member>
consteval Row calibration(Text name, Text unit, double min, double max, ParamChange change, Text description) {
  return param<Parameters, &Parameters::estimator, &EstimatorOptions::calibration, Member>(name, unit, min, max,
                                                                                           description, change);
}
template <auto Member>
consteval Row tracker(Text name, Text unit, double min, double max, ParamChange change, Text description) {
  return param<Parameters, &Parameters::tracker, Member>(name, unit, min, max, description, change);
}
template <auto Member>
consteval Row modes(Text name, Text unit, double min, double max, ParamChange change, Text description) {
  return param<Parameters, &Parameters::modes, Member>(name, unit, min, max, description, change);
}

constexpr std::array kRows{
    imu<&ImuOptions::gyro_noise_density>("imu.gyro_noise_density", "rad/s/sqrt(Hz)", 1e-7, 1e-1, kInFlight,
                                         "white noise of the gyro"),
    imu<&ImuOptions::gyro_scale_error>("imu.gyro_scale_error", "1", 0.0, 0.1, kInFlight,
                                       "of the rate, 1 sigma: errors of scale and of the axes' directions"),
    imu<&ImuOptions::gyro_bias_walk>("imu.gyro_bias_walk", "rad/s^2/sqrt(Hz)", 0.0, 1e-1, kInFlight,
                                     "random walk of the gyro bias"),
    imu<&ImuOptions::accel_noise_density>("imu.accel_noise_density", "m/s^2/sqrt(Hz)", 1e-6, 1.0, kInFlight,
                                          "white noise of the accelerometer"),
    imu<&ImuOptions::accel_bias_walk>("imu.accel_bias_walk", "m/s^3/sqrt(Hz)", 0.0, 1.0, kInFlight,
                                      "random walk of the accelerometer bias"),
    imu<&ImuOptions::gravity_m_s2>("imu.gravity", "m/s^2", 0.1, 30.0, kNever, "local gravity"),
    imu<&ImuOptions::max_gap_s>("imu.max_gap", "s", 0.001, 1.0, kInFlight,
                                "a longer hole in the IMU stream is a fault"),
    imu<&ImuOptions::max_accel_m_s2>("imu.max_accel", "m/s^2", 12.0, 2000.0, kInFlight,
                                     "scale of an axis: at its end a reading is clipped, beyond it a fault"),
    imu<&ImuOptions::max_gyro_rad_s>("imu.max_gyro", "rad/s", 1.0, 100.0, kInFlight,
                                     "scale of an axis: at its end a reading is clipped, beyond it a fault"),

    vision<&VisionOptions::pixel_noise_px>("vision.pixel_noise", "px", 0.01, 20.0, kInFlight,
                                           "1 sigma of a tracked feature"),
    vision<&VisionOptions::pixel_noise_images>("vision.pixel_noise_images", "1", 0, 10000, kInFlight,
                                               "images over which the noise follows the innovations; 0: it stays"),
    vision<&VisionOptions::pixel_noise_min_px>("vision.pixel_noise_min", "px", 0.01, 20.0, kInFlight,
                                               "least noise it comes to"),
    vision<&VisionOptions::pixel_noise_max_px>("vision.pixel_noise_max", "px", 0.01, 20.0, kInFlight,
                                               "largest noise it comes to"),
    vision<&VisionOptions::gate_probability>("vision.gate_probability", "1", 0.9, 0.999999, kInFlight,
                                             "chi-square gate of visual rows"),
    vision<&VisionOptions::min_parallax_px>("vision.min_parallax", "px", 0.0, 200.0, kInFlight,
                                            "rotation-free track extent needed to triangulate"),
    vision<&VisionOptions::ranged_min_parallax_px>("vision.ranged_min_parallax", "px", 0.0, 200.0, kInFlight,
                                                   "track extent needed to use a range with it"),
    vision<&VisionOptions::min_depth_m>("vision.min_depth", "m", 0.001, 1000.0, kInFlight,
                                        "semi-infinite start: inverse depth 1/(2 d_min)"),
    vision<&VisionOptions::max_depth_m>("vision.max_depth", "m", 1.0, 1e6, kInFlight,
                                        "a feature triangulated beyond this is not used"),
    vision<&VisionOptions::min_track_length>("vision.min_track_length", "1", 2, 32, kInFlight,
                                             "observations an ended track must have to be used"),
    vision<&VisionOptions::pose_interval_s>("vision.pose_interval", "s", 0.0, 1.0, kInFlight,
                                            "between poses that stay in the window"),
    vision<&VisionOptions::max_rejections>("vision.max_rejections", "1", 1, 100, kInFlight,
                                           "consecutive gate failures that a SLAM feature survives"),
    vision<&VisionOptions::slam_velocity_sigma>(
        "vision.slam_velocity_sigma", "1", 0.001, 1000.0, kInFlight,
        "of the velocity, above which features wait for the ranges to tell the scale"),
    vision<&VisionOptions::tiles_x>("vision.tiles_x", "1", 1, 8, kInFlight,
                                    "SLAM features are spread over tiles_x by tiles_y"),
    vision<&VisionOptions::tiles_y>("vision.tiles_y", "1", 1, 8, kInFlight,
                                    "SLAM features are spread over tiles_x by tiles_y"),
    vision<&VisionOptions::spot_features>("vision.spot_features", "1", 0, 100, kInFlight,
                                          "SLAM features put around the laser's spot before others"),

    range<&RangeOptions::enabled>("range.enabled", "1", 0, 1, kInFlight, "use the range finder"),
    range<&RangeOptions::noise_m>("range.noise", "m", 1e-4, 10.0, kInFlight, "1 sigma of the device"),
    range<&RangeOptions::min_range_m>("range.min_range", "m", 0.0, 100.0, kInFlight, "shorter ranges are invalid"),
    range<&RangeOptions::max_range_m>("range.max_range", "m", 0.1, 10000.0, kInFlight, "longer ranges are invalid"),
    range<&RangeOptions::gate_sigma>("range.gate_sigma", "1", 1.5, 100.0, kInFlight, "Mahalanobis gate of a range"),
    range<&RangeOptions::max_age_s>("range.max_age", "s", 0.0, 10.0, kInFlight, "a range older than this is stale"),
    range<&RangeOptions::max_incidence_deg>("range.max_incidence", "deg", 0.0, 89.9, kInFlight,
                                            "largest angle between beam and facet normal"),
    range<&RangeOptions::max_facet_edge>("range.max_facet_edge", "1", 0.001, 10.0, kInFlight,
                                         "longest facet edge in the normalised image plane"),
    range<&RangeOptions::feature>("range.feature", "1", 0, 1, kInFlight,
                                  "give ranges to the tracks at the laser's spot"),
    range<&RangeOptions::facet>("range.facet", "1", 0, 1, kInFlight, "compare ranges with the facet under them"),
    range<&RangeOptions::facet_after_s>("range.facet_after", "s", 0.0, 1000.0, kInFlight,
                                        "time without use of a ranged track before facets are asked"),
    range<&RangeOptions::relief>("range.relief", "1", 0, 1, kInFlight,
                                 "put what features tell of the ground into the noise of a facet"),
    range<&RangeOptions::depth_prior>("range.depth_prior", "1", 0, 1, kInFlight,
                                      "take new features to be as far as the last range"),
    range<&RangeOptions::max_features>("range.max_features", "1", 0, 100, kInFlight,
                                       "SLAM features that may be ranged ones"),
    range<&RangeOptions::feature_slope>("range.feature_slope", "1", 0.0, 10.0, kInFlight,
                                        "slope of the ground between a ranged feature and the laser's spot"),

    direction<&DirectionOptions::sun_noise_rad>("direction.sun_noise", "rad", 0.0, 1.0, kInFlight,
                                                "1 sigma of a sun sensor, per axis; 0: it is not used"),
    direction<&DirectionOptions::magnetometer_noise_rad>(
        "direction.magnetometer_noise", "rad", 0.0, 1.0, kInFlight,
        "1 sigma of the direction of the magnetic field; 0: it is not used"),
    direction<&DirectionOptions::gate_probability>("direction.gate_probability", "1", 0.9, 0.999999, kInFlight,
                                                   "chi-square gate of known directions"),

    start<&StartOptions::gyro_bias_sigma_rad_s>("start.gyro_bias_sigma", "rad/s", 1e-6, 1.0, kAtStart,
                                                "1 sigma of the turn-on gyro bias"),
    start<&StartOptions::accel_bias_sigma_m_s2>("start.accel_bias_sigma", "m/s^2", 1e-6, 10.0, kAtStart,
                                                "1 sigma of the turn-on accelerometer bias"),
    start<&StartOptions::still_gyro_rad_s>("start.still_gyro", "rad/s", 1e-5, 1.0, kInFlight,
                                           "standard deviation below which the gyro is still"),
    start<&StartOptions::still_accel_m_s2>("start.still_accel", "m/s^2", 1e-4, 10.0, kInFlight,
                                           "standard deviation below which the accelerometer is still"),
    start<&StartOptions::still_image_px>("start.still_image", "px", 0.01, 20.0, kInFlight,
                                         "image motion below which the image is still"),
    start<&StartOptions::still_window_s>("start.still_window", "s", 0.05, kMaxStartWindow_s, kInFlight,
                                         "span of the standstill test"),
    start<&StartOptions::in_motion>("start.in_motion", "1", 0, 1, kInFlight,
                                    "start in motion too, not from a standstill alone"),
    start<&StartOptions::motion_window_s>("start.motion_window", "s", 0.1, kMaxStartWindow_s, kAtStart,
                                          "shortest span an in-motion start is tried on"),
    start<&StartOptions::motion_window_max_s>("start.motion_window_max", "s", 0.1, kMaxStartWindow_s, kAtStart,
                                              "longest span: then ranges start it with the uncertainty it has"),

    calibration<&CalibrationOptions::time_offset_sigma_s>(
        "calibration.time_offset_sigma", "s", 0.0, 0.05, kAtStart,
        "1 sigma of image stamps against the IMU's; 0: not estimated"),
    calibration<&CalibrationOptions::camera_rotation_sigma_rad>(
        "calibration.camera_rotation_sigma", "rad", 0.0, 0.2, kAtStart, "1 sigma of the camera's attitude on the IMU"),
    calibration<&CalibrationOptions::camera_position_sigma_m>("calibration.camera_position_sigma", "m", 0.0, 1.0,
                                                              kAtStart, "1 sigma of the camera's place on the IMU"),
    calibration<&CalibrationOptions::beam_tilt_sigma_rad>("calibration.beam_tilt_sigma", "rad", 0.0, 0.2, kAtStart,
                                                          "1 sigma of the range finder's direction"),
    calibration<&CalibrationOptions::beam_origin_sigma_m>("calibration.beam_origin_sigma", "m", 0.0, 1.0, kAtStart,
                                                          "1 sigma of the range finder's place at the camera"),
    calibration<&CalibrationOptions::gyro_scale_sigma>("calibration.gyro_scale_sigma", "1", 0.0, 0.1, kAtStart,
                                                       "1 sigma of the gyro's scale factors"),
    calibration<&CalibrationOptions::accel_scale_sigma>("calibration.accel_scale_sigma", "1", 0.0, 0.1, kAtStart,
                                                        "1 sigma of the accelerometer's scale factors"),

    tracker<&TrackerOptions::max_features>("tracker.max_features", "1", 1, FlightConfig::kMaxTracks, kNever,
                                           "live tracks kept at once"),
    tracker<&TrackerOptions::tile_columns>("tracker.tile_columns", "1", 1, 64, kNever, "detection tiles across"),
    tracker<&TrackerOptions::tile_rows>("tracker.tile_rows", "1", 1, 64, kNever, "detection tiles down"),
    tracker<&TrackerOptions::min_distance_px>("tracker.min_distance", "px", 0, 200, kNever,
                                              "between a new feature and every live one"),
    tracker<&TrackerOptions::border_px>("tracker.border", "px", TrackerOptions::kMinBorder_px, 200, kNever,
                                        "features nearer to the image edge are dropped"),
    tracker<&TrackerOptions::fast_threshold_min>("tracker.fast_threshold_min", "grey levels", 1, 255, kInFlight,
                                                 "lowest FAST threshold of a tile"),
    tracker<&TrackerOptions::fast_threshold_max>("tracker.fast_threshold_max", "grey levels", 1, 255, kInFlight,
                                                 "highest FAST threshold of a tile"),
    tracker<&TrackerOptions::window_px>("tracker.window", "px", 5, TrackerOptions::kMaxWindow_px, kNever,
                                        "odd side of the tracked patch"),
    tracker<&TrackerOptions::levels>("tracker.levels", "1", 1, TrackerOptions::kMaxPyramidLevels, kNever,
                                     "pyramid levels including the full image"),
    tracker<&TrackerOptions::max_iterations>("tracker.max_iterations", "1", 1, 100, kNever,
                                             "Lucas-Kanade steps per level"),
    tracker<&TrackerOptions::epsilon_px>("tracker.epsilon", "px", 1e-6, 10.0, kNever,
                                         "a smaller step ends the iteration"),
    tracker<&TrackerOptions::min_eigenvalue>("tracker.min_eigenvalue", "1", 1e-12, 1e6, kNever,
                                             "smallest eigenvalue of a patch's structure tensor"),
    tracker<&TrackerOptions::light_change>("tracker.light_change", "1", 0, 1, kNever,
                                           "follow patches whose light changes by a gain and an offset"),
    tracker<&TrackerOptions::max_residual>("tracker.max_residual", "grey levels", 0.1, 255.0, kInFlight,
                                           "mean absolute difference of the patch"),
    tracker<&TrackerOptions::min_similarity>("tracker.min_similarity", "1", 0.01, 0.999, kInFlight,
                                             "correlation with its first patch below which a feature ends"),
    tracker<&TrackerOptions::max_correction_px>("tracker.max_correction", "px", 1e-3, 100.0, kInFlight,
                                                "between flow and patch alignment, above which likewise"),
    tracker<&TrackerOptions::outlier_px>("tracker.outlier", "px", 1e-3, 100.0, kInFlight,
                                         "distance to the epipolar line"),

    modes<&ModeOptions::image_timeout_s>("modes.image_timeout", "s", 0.01, 100.0, kInFlight,
                                         "without an image of use, after which the mode is inertial"),
    modes<&ModeOptions::range_timeout_s>("modes.range_timeout", "s", 0.01, 100.0, kInFlight,
                                         "without a range of use, after which the mode is VIO"),
    modes<&ModeOptions::imu_timeout_s>("modes.imu_timeout", "s", 0.01, 10.0, kInFlight,
                                       "without an IMU sample, after which navigation has failed"),
    modes<&ModeOptions::start_time_s>("modes.start_time", "s", 0.0, 1000.0, kInFlight,
                                      "that the IMU may take to say something after power-up"),
    modes<&ModeOptions::steady_s>("modes.steady", "s", 0.0, 100.0, kInFlight,
                                  "of IMU samples without a hole that end a failure"),
    modes<&ModeOptions::max_resets>("modes.max_resets", "1", 1, ModeMachine::kMaxResets, kInFlight,
                                    "resets that nobody commanded, within modes.reset_window, that are a failure"),
    modes<&ModeOptions::reset_window_s>("modes.reset_window", "s", 0.1, 1000.0, kInFlight,
                                        "in which resets are counted"),
    modes<&ModeOptions::fault_recovery_s>("modes.fault_recovery", "s", 0.1, 1000.0, kInFlight,
                                          "to have a state again after a numerical fault"),
    modes<&ModeOptions::rejected_after>("modes.rejected_after", "1", 1, 100000, kInFlight,
                                        "samples refused in a row that make a sensor a rejected one"),
    modes<&ModeOptions::degraded_after>("modes.degraded_after", "1", 1, 100000, kInFlight,
                                        "samples refused in a row that make a sensor a degraded one"),
    modes<&ModeOptions::restored_after>("modes.restored_after", "1", 1, 100000, kInFlight,
                                        "samples accepted in a row that restore it"),
    modes<&ModeOptions::poor_share>("modes.poor_share", "1", 0.0, 1.0, kInFlight,
                                    "of the samples of a second refused, above which a sensor is degraded"),
    modes<&ModeOptions::poor_rate>("modes.poor_rate", "1", 0.0, 1.0, kInFlight,
                                   "of its best rate, below which a sensor is degraded"),
    modes<&ModeOptions::position_sigma_limit_m>("modes.position_sigma_limit", "m", 1e-3, 1e6, kInFlight,
                                                "1 sigma of an axis above which a state is not reliable"),
    modes<&ModeOptions::velocity_sigma_limit_m_s>("modes.velocity_sigma_limit", "m/s", 1e-3, 1e6, kInFlight,
                                                  "1 sigma of an axis above which a state is not reliable"),
    modes<&ModeOptions::horizon_s>("modes.horizon", "s", 0.1, 3600.0, kInFlight,
                                   "longest time for which reliability is foretold"),
};
static_assert(param_names_unique<Parameters>(kRows), "two parameters share a name");

static_assert(kRows.size() <= kMaxParams, "params_t in session.lcm has no room for so many parameters");

constexpr bool names_fit() {
  for (const Row& row : kRows) {
    if (row.name.size() > kMaxParamName) return false;
  }
  return true;
}
static_assert(names_fit(), "a parameter's name is too long for params_t in session.lcm");

constexpr ParamTable<Parameters> kTable{kRows};

}  // namespace

const ParamTable<Parameters>& parameter_table() { return kTable; }

std::uint32_t parameter_table_crc() {
  static constexpr std::uint32_t kCrc = kTable.crc();
  return kCrc;
}

FixedVector<const char*, kMaxConflicts> conflicts_in(const Parameters& parameters) {
  const auto& [imu, vision, range, direction, start, calibration] = parameters.estimator;
  const TrackerOptions& tracker = parameters.tracker;
  FixedVector<const char*, kMaxConflicts> conflicts;
  const auto expect = [&conflicts](bool holds, const char* sentence) {
    if (!holds) (void)conflicts.push_back(sentence);
  };
  expect(range.min_range_m < range.max_range_m, "range.min_range must be below range.max_range");
  expect(vision.min_depth_m < vision.max_depth_m, "vision.min_depth must be below vision.max_depth");
  expect(vision.pixel_noise_min_px <= vision.pixel_noise_max_px,
         "vision.pixel_noise_min must not be above vision.pixel_noise_max");
  expect(start.motion_window_s <= start.motion_window_max_s,
         "start.motion_window must not be above start.motion_window_max");
  expect(tracker.window_px % 2 == 1, "tracker.window must be odd");
  expect(tracker.tile_columns * tracker.tile_rows <= static_cast<std::int32_t>(kMaxTiles),
         "tracker.tile_columns times tracker.tile_rows must be at most 64");
  static_assert(kMaxTiles == 64, "the sentence above says so");
  expect(tracker.fast_threshold_min <= tracker.fast_threshold_max,
         "tracker.fast_threshold_min must not be above tracker.fast_threshold_max");
  expect(!range.enabled || !range.facet || parameters.modes.range_timeout_s > range.facet_after_s,
         "modes.range_timeout must be above range.facet_after: ranges are spared so long on purpose");
  return conflicts;
}

ParamsRecord params_record(const Parameters& parameters, std::string_view configuration) {
  ParamsRecord record;
  PLUMB_ASSERT(configuration.size() <= kMaxConfigName);
  std::copy(configuration.begin(), configuration.end(), record.configuration.begin());
  for (const Row& row : kRows) {
    ParamValue value{.value = row.get(parameters)};
    std::copy(row.name.begin(), row.name.end(), value.name.begin());
    const Status added = record.values.push_back(value);
    PLUMB_ASSERT(ok(added));  // the table was measured against the record when it was compiled
  }
  return record;
}

}  // namespace plumb
