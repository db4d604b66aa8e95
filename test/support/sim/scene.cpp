#include "test/support/sim/scene.h"

#include <algorithm>
#include <array>
#include <stdexcept>

namespace plumb::sim {
namespace {

constexpr double kStandingCamera_m = 0.3;  // camera above the ground before take-off

constexpr std::array<std::string_view, 12> kNames = {"outdoor_cruise",
                                                     "outdoor_cruise_stepped",
                                                     "outdoor_cruise_roofs",
                                                     "cruise_from_start",
                                                     "cruise_from_start_stepped",
                                                     "hover",
                                                     "descent",
                                                     "vertical_descent",
                                                     "excitation",
                                                     "circuit",
                                                     "indoor",
                                                     "mars"};
constexpr double kMarsGravity_m_s2 = 3.71;

// A filter that is told "no noise" cannot be factorised; a noise-free simulation is filtered with these instead.
constexpr double kLeastGyroNoise = 1e-6;   // rad/s/sqrt(Hz)
constexpr double kLeastAccelNoise = 1e-5;  // m/s^2/sqrt(Hz)
constexpr double kLeastBiasWalk = 1e-8;
constexpr double kLeastGyroBias_rad_s = 1e-6;
constexpr double kLeastAccelBias_m_s2 = 1e-5;
constexpr double kLeastPixelNoise_px = 0.02;
constexpr double kLeastRangeNoise_m = 1e-3;

World other_steps(std::uint64_t seed) { return stepped_ground(seed); }

}  // namespace

std::span<const std::string_view> scene_names() { return kNames; }

Scene make_scene(std::string_view name) {
  const Rig rig = nadir_rig();
  const Vec3 ground_m = rig.ground_position_m(kStandingCamera_m);
  const std::string text(name);
  if (name == "outdoor_cruise") return {text, outdoor_cruise(ground_m), flat_ground(), rig};
  if (name == "outdoor_cruise_stepped") return {text, outdoor_cruise(ground_m), stepped_ground(), rig};
  if (name == "outdoor_cruise_roofs") return {text, outdoor_cruise(ground_m), flat_then_roofs(), rig};
  if (name == "cruise_from_start") return {text, cruise_from_start(), flat_ground(), rig};
  if (name == "cruise_from_start_stepped") return {text, cruise_from_start(), stepped_ground(), rig};
  if (name == "hover") return {text, hover(ground_m), stepped_ground(), rig};
  if (name == "descent") return {text, descent(), stepped_ground(), rig};
  if (name == "vertical_descent") return {text, vertical_descent(), stepped_ground(), rig, other_steps};
  if (name == "excitation") return {text, excitation(ground_m), stepped_ground(), rig};
  if (name == "circuit") return {text, circuit(ground_m), stepped_ground(), rig};
  if (name == "indoor") return {text, hand_held(), box_line(1), rig, box_line};
  if (name == "mars") {
    constexpr double kHeight_m = 9.0;
    return {text, outdoor_cruise(ground_m, kHeight_m), stepped_ground(), rig, other_steps, kMarsGravity_m_s2};
  }
  throw std::invalid_argument("no scene named '" + text + "'");
}

EstimatorOptions matched_options(const FlightSettings& settings) {
  EstimatorOptions options;
  options.imu.gyro_noise_density = std::max(settings.imu.gyro_noise_density, kLeastGyroNoise);
  options.imu.gyro_bias_walk = std::max(settings.imu.gyro_bias_walk, kLeastBiasWalk);
  options.imu.accel_noise_density = std::max(settings.imu.accel_noise_density, kLeastAccelNoise);
  options.imu.accel_bias_walk = std::max(settings.imu.accel_bias_walk, kLeastBiasWalk);
  options.imu.gyro_scale_error = 0.0;  // the simulated gyro has none
  options.vision.pixel_noise_px = std::max(settings.tracker.pixel_noise_px, kLeastPixelNoise_px);
  options.range.noise_m = std::max(settings.range.sigma_m(), kLeastRangeNoise_m);
  options.range.max_range_m = settings.range.max_range_m;
  options.direction.sun_noise_rad = settings.sun.noise_rad;
  options.direction.magnetometer_noise_rad = settings.magnetometer.noise_rad;
  options.start.gyro_bias_sigma_rad_s = std::max(settings.imu.gyro_turn_on_rad_s, kLeastGyroBias_rad_s);
  options.start.accel_bias_sigma_m_s2 = std::max(settings.imu.accel_turn_on_m_s2, kLeastAccelBias_m_s2);
  return options;
}

}  // namespace plumb::sim
