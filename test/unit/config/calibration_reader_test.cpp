#include "config/calibration_reader.h"

#include <gtest/gtest.h>

#include <functional>
#include <numbers>

#include "config/input_error.h"
#include "test/support/temporary_folder.h"

namespace plumb {
namespace {

// Camera rotated by 90 degrees about z and moved in the body; IMU moved in the body.
constexpr const char* kCamera =
    "T_BS:\n  data: [0, -1, 0, 0.5, 1, 0, 0, 0.25, 0, 0, 1, 0.125, 0, 0, 0, 1]\n"
    "camera_model: pinhole\nresolution: [640, 480]\nintrinsics: [400, 410, 319.5, 239.5]\n";
constexpr const char* kImu =
    "T_BS:\n  data: [1, 0, 0, 0.1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n"
    "gyroscope_noise_density: 1e-4\ngyroscope_random_walk: 2e-5\n"
    "accelerometer_noise_density: 3e-3\naccelerometer_random_walk: 4e-3\n";
constexpr const char* kNoLens = "distortion_model: none\n";

std::string refusal(const std::function<void()>& call) {
  try {
    call();
  } catch (const InputError& error) {
    return error.what();
  }
  return "not refused";
}

TEST(CalibrationReader, ReadsCameraAndItsPoseInTheImu) {
  const test::TemporaryFolder folder;
  folder.write("cam0/sensor.yaml", std::string(kCamera) + kNoLens);
  folder.write("imu0/sensor.yaml", kImu);
  std::vector<std::string> warnings;
  Calibration calibration;
  read_camera(folder.path() / "cam0", folder.path() / "imu0", calibration, warnings);
  EXPECT_EQ(calibration.camera.width, 640);
  EXPECT_EQ(calibration.camera.fy, 410.0);
  EXPECT_EQ(calibration.camera.distortion, Distortion::kNone);
  const double half_turn = std::numbers::pi / 2.0;
  EXPECT_NEAR((so3_log(calibration.sensor.q_IC) - Vec3(0.0, 0.0, half_turn)).norm(), 0.0, 1e-12);
  EXPECT_NEAR((calibration.sensor.p_IC_m - Vec3(0.4, 0.25, 0.125)).norm(), 0.0, 1e-12);
  EXPECT_DOUBLE_EQ(calibration.sensor.focal_px, 405.0);
  EXPECT_NEAR(calibration.sensor.half_fov_x, 319.5 / 400.0, 1e-9);
  EXPECT_NEAR(calibration.sensor.half_fov_y, 239.5 / 410.0, 1e-9);
}

TEST(CalibrationReader, ReadsEveryLensModel) {
  struct Case {
    const char* yaml;
    Distortion distortion;
    double first;
  };
  const Case cases[] = {
      {"distortion_model: radial-tangential\ndistortion_coefficients: [-0.1, 0.01, 0, 0]\n",
       Distortion::kRadialTangential, -0.1},
      {"distortion_model: equidistant\ndistortion_coefficients: [0.01, 0, 0, 0]\n", Distortion::kEquidistant, 0.01},
      {"distortion_model: fov\ndistortion_coefficients: [0.9]\n", Distortion::kFov, 0.9}};
  for (const Case& c : cases) {
    SCOPED_TRACE(c.yaml);
    const test::TemporaryFolder folder;
    folder.write("cam0/sensor.yaml", std::string(kCamera) + c.yaml);
    folder.write("imu0/sensor.yaml", kImu);
    std::vector<std::string> warnings;
    Calibration calibration;
    read_camera(folder.path() / "cam0", folder.path() / "imu0", calibration, warnings);
    EXPECT_EQ(calibration.camera.distortion, c.distortion);
    EXPECT_EQ(calibration.camera.coefficients[0], c.first);
  }
}

TEST(CalibrationReader, SetsNoiseAndGravityParameters) {
  const test::TemporaryFolder folder;
  std::vector<std::string> warnings;
  Parameters parameters;
  folder.write("sensor.yaml", kImu);
  read_imu(folder.path(), parameters, warnings);
  EXPECT_EQ(parameters.estimator.imu.gyro_noise_density, 1e-4);
  EXPECT_EQ(parameters.estimator.imu.gyro_bias_walk, 2e-5);
  EXPECT_EQ(parameters.estimator.imu.accel_noise_density, 3e-3);
  EXPECT_EQ(parameters.estimator.imu.accel_bias_walk, 4e-3);
  EXPECT_EQ(parameters.estimator.imu.gravity_m_s2, 9.80665);
  EXPECT_EQ(parameters.estimator.start.gyro_bias_sigma_rad_s, Parameters{}.estimator.start.gyro_bias_sigma_rad_s);
  folder.write("sensor.yaml", std::string(kImu) + "gravity_mps2: 3.71\n" +
                                  "gyroscope_bias_stddev: 5e-5\naccelerometer_bias_stddev: 9e-3\n");
  read_imu(folder.path(), parameters, warnings);
  EXPECT_EQ(parameters.estimator.imu.gravity_m_s2, 3.71);
  EXPECT_EQ(parameters.estimator.start.gyro_bias_sigma_rad_s, 5e-5);
  EXPECT_EQ(parameters.estimator.start.accel_bias_sigma_m_s2, 9e-3);
}

TEST(CalibrationReader, ReadsTheRangeFinder) {
  const test::TemporaryFolder folder;
  folder.write("sensor.yaml",
               "noise_stddev_m: 0.02\nmax_range_m: 30\naxis_in_cam: [0, 0, 1]\norigin_in_cam_m: [0.1, 0.2, 0.3]\n");
  std::vector<std::string> warnings;
  Calibration calibration;
  Parameters parameters;
  read_range_finder(folder.path(), calibration, parameters, warnings);
  EXPECT_EQ(parameters.estimator.range.noise_m, 0.02);
  EXPECT_EQ(parameters.estimator.range.max_range_m, 30.0);
  EXPECT_EQ(calibration.sensor.u_C, Vec3::UnitZ());
  EXPECT_EQ(calibration.sensor.p_CR_m, Vec3(0.1, 0.2, 0.3));
  EXPECT_TRUE(warnings.empty());
}

TEST(CalibrationReader, TakesParametersNestedOrWithDotsAndFlags) {
  const test::TemporaryFolder folder;
  Parameters parameters;
  read_parameters(folder.write("p.yaml", "range:\n  gate_sigma: 3\n  enabled: false\nimu.max_gap: 0.2\n"), parameters);
  EXPECT_EQ(parameters.estimator.range.gate_sigma, 3.0);
  EXPECT_FALSE(parameters.estimator.range.enabled);
  EXPECT_EQ(parameters.estimator.imu.max_gap_s, 0.2);
}

TEST(CalibrationReader, RefusesAParameterFileWhole) {
  struct Case {
    const char* yaml;
    const char* message;
  };
  const Case cases[] = {
      {"imu.max_gap: 0.2\nrange:\n  gate: 3\n", "p.yaml line 3: key 'range.gate': no parameter has this name"},
      {"imu.max_gap: 0.2\nrange.gate_sigma: 1e9\n",
       "refused for range.gate_sigma; expected from 1.5 to 100, found '1e9'"},
      {"imu.max_gap: 0.2\nvision.tiles_x: 2.5\n", "expected a whole number from 1 to 8"},
      {"imu.max_gap: 0.2\nrange.noise: .nan\n", "refused for range.noise; expected from 0.0001 to 10 m"},
      {"imu.max_gap: 0.2\nrange.noise: [1]\n", "key 'range.noise': expected a number"},
      {"imu.max_gap: 0.2\nrange.noise: {\n", "not readable as YAML"},
      {"imu.max_gap: 0.2\nimu.max_gap: 0.3\n",
       "p.yaml line 2: key 'imu.max_gap': stands on line 1 already; expected once, found '0.3'"},
      {"imu.max_gap: 0.2\nrange:\n  noise: 1\n  noise: 1\n",
       "p.yaml line 4: key 'range.noise': stands on line 3 already"},
      {"imu.max_gap: 0.2\n? [a, b]\n: 3\n", "expected keys of one word"},
      {"imu.max_gap: 0.2\nrange: &itself\n  noise: *itself\n", "expected at most 32 levels of keys"},
      {"- 1\n", "expected a YAML map"}};
  for (const Case& c : cases) {
    SCOPED_TRACE(c.yaml);
    const test::TemporaryFolder folder;
    Parameters parameters;
    const std::string told = refusal([&] { read_parameters(folder.write("p.yaml", c.yaml), parameters); });
    EXPECT_NE(told.find(c.message), std::string::npos) << told;
    EXPECT_EQ(parameters.estimator.imu.max_gap_s, Parameters{}.estimator.imu.max_gap_s);
  }
}

}  // namespace
}  // namespace plumb
