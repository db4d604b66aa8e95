// Configurations that name the files of Kalibr.

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "config/flight_config.h"
#include "test/support/property.h"
#include "test/support/temporary_folder.h"

namespace plumb {
namespace {

const std::string kImuSection = "imu:\n  device: /dev/ttyS1\n  kalibr: calibration/imu.yaml\n";
const std::string kCameraSection = "camera:\n  socket: /run/camera\n  kalibr: calibration/camchain-imucam.yaml\n";

// As Kalibr writes them. The camera is turned by 90 degrees about z: what the IMU has at x the camera has at -y.
const std::string kCamchain = R"(cam0:
  T_cam_imu:
  - [0.0, 1.0, 0.0, -0.25]
  - [-1.0, 0.0, 0.0, 0.5]
  - [0.0, 0.0, 1.0, -0.125]
  - [0.0, 0.0, 0.0, 1.0]
  cam_overlaps: []
  camera_model: pinhole
  distortion_coeffs: [-0.1, 0.01, 0.001, -0.002]
  distortion_model: radtan
  intrinsics: [400.0, 410.0, 319.5, 239.5]
  resolution: [640, 480]
  rostopic: /cam0/image_raw
  timeshift_cam_imu: -0.00425
)";
const std::string kNoise = R"(accelerometer_noise_density: 3.0e-03
accelerometer_random_walk: 4.0e-03
gyroscope_noise_density: 1.0e-04
gyroscope_random_walk: 2.0e-05
rostopic: /imu0
update_rate: 250.0
)";

class KalibrTest : public testing::Test {
 protected:
  FlightSetup read(const std::string& configuration) {
    faults_.clear();
    folder_.write("calibration/camchain-imucam.yaml", camchain_);
    folder_.write("calibration/imu.yaml", noise_);
    return read_flight_config(folder_.write("flight.yaml", configuration), faults_);
  }
  bool names(const std::string& what) const {
    return std::any_of(faults_.begin(), faults_.end(),
                       [&](const std::string& fault) { return fault.find(what) != std::string::npos; });
  }
  static void replace(std::string& text, const std::string& piece, const std::string& by) {
    const std::size_t at = text.find(piece);
    ASSERT_NE(at, std::string::npos) << piece;
    text.replace(at, piece.size(), by);
  }

  test::TemporaryFolder folder_;
  std::string camchain_ = kCamchain;
  std::string noise_ = kNoise;
  std::vector<std::string> faults_;
};

TEST_F(KalibrTest, ReadsCameraNoiseAndShift) {
  const FlightSetup setup = read(kImuSection + "  gravity_mps2: 3.71\n" + kCameraSection);
  EXPECT_EQ(faults_, std::vector<std::string>{});
  EXPECT_EQ(setup.calibration.camera.height, 480);
  EXPECT_EQ(setup.calibration.camera.fy, 410.0);
  EXPECT_EQ(setup.calibration.camera.distortion, Distortion::kRadialTangential);
  EXPECT_EQ(setup.calibration.camera.coefficients[3], -0.002);
  EXPECT_EQ(setup.calibration.sensor.focal_px, 405.0);
  const Vec3 turn(0.0, 0.0, std::numbers::pi / 2.0);
  EXPECT_NEAR((so3_log(setup.calibration.sensor.q_IC) - turn).norm(), 0.0, 1e-12);
  EXPECT_NEAR((setup.calibration.sensor.p_IC_m - Vec3(0.5, 0.25, 0.125)).norm(), 0.0, 1e-12);
  EXPECT_EQ(setup.camera.shift, Duration::from_us(-4250));
  EXPECT_EQ(setup.parameters.estimator.imu.gyro_noise_density, 1e-4);
  EXPECT_EQ(setup.parameters.estimator.imu.accel_bias_walk, 4e-3);
  EXPECT_EQ(setup.parameters.estimator.imu.gravity_m_s2, 3.71);
}

// T_cam_imu takes a point of the IMU's frame to the camera's, whatever it is: so does the pose that is flown with.
TEST_F(KalibrTest, AnyPointComesToTheSamePlace) {
  test::for_all(50, [this](test::Generator& g) {
    const Mat3 r_CI = so3_exp(g.normal_vector<3>(1.0)).toRotationMatrix();
    const Vec3 p_CI = g.normal_vector<3>(0.3);
    std::string rows = "T_cam_imu: [";
    for (int r = 0; r < 3; ++r) {
      char text[160];
      std::snprintf(text, sizeof text, "[%.17g, %.17g, %.17g, %.17g], ", r_CI(r, 0), r_CI(r, 1), r_CI(r, 2), p_CI(r));
      rows += text;
    }
    camchain_ = kCamchain;
    const std::size_t begin = camchain_.find("T_cam_imu");
    camchain_.replace(begin, camchain_.find("  cam_overlaps") - begin, rows + "[0, 0, 0, 1]]\n");
    const FlightSetup setup = read(kImuSection + kCameraSection);
    ASSERT_EQ(faults_, std::vector<std::string>{});
    const Vec3 point_I = g.normal_vector<3>(2.0);
    const Vec3 point_C = r_CI * point_I + p_CI;
    EXPECT_NEAR((setup.calibration.sensor.q_IC * point_C + setup.calibration.sensor.p_IC_m - point_I).norm(), 0.0,
                1e-12);
  });
}

TEST_F(KalibrTest, TakesAnotherCameraAnImuSectionAndNoShift) {
  replace(camchain_, "cam0:", "cam3:");
  replace(camchain_, "  timeshift_cam_imu: -0.00425\n", "");
  noise_ = "imu0:\n  T_i_b:\n  - [1, 0, 0, 0]\n  - [0, 1, 0, 0]\n  - [0, 0, 1, 0]\n  - [0, 0, 0, 1]\n";
  for (std::size_t at = 0; at < kNoise.size(); at = kNoise.find('\n', at) + 1) {
    noise_ += "  " + kNoise.substr(at, kNoise.find('\n', at) + 1 - at);
  }
  const FlightSetup setup = read(kImuSection + kCameraSection + "  kalibr_camera: cam3\n");
  EXPECT_EQ(faults_, std::vector<std::string>{});
  EXPECT_EQ(setup.camera.shift, Duration());
  EXPECT_EQ(setup.parameters.estimator.imu.gyro_bias_walk, 2e-5);
}

// Every fault of all three files, each with file and key.
TEST_F(KalibrTest, NamesEveryFaultAtOnce) {
  replace(camchain_, "[0.0, 1.0, 0.0, -0.25]", "[0.0, -1.0, 0.0, -0.25]");
  replace(camchain_, "radtan", "omni");
  replace(camchain_, "-0.00425", "4.25");
  replace(camchain_, "  resolution: [640, 480]\n", "");
  replace(noise_, "gyroscope_random_walk: 2.0e-05\n",
          "T_i_b: [[1, 0, 0, 1], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n");
  replace(noise_, "3.0e-03", "-3.0e-03");
  read(kImuSection + "  accelerometer_random_walk: 1e-3\n" + kCameraSection +
       "  rate_hz: 1000\n  intrinsics: [400, 400, 320, 240]\n");
  for (const char* what :
       {"camchain-imucam.yaml line 3: key 'cam0.T_cam_imu': expected a rigid transform",
        "key 'cam0.distortion_model': expected radial-tangential, equidistant, fov or none, found 'omni'",
        "key 'cam0.timeshift_cam_imu': expected -1 to 1", "key 'cam0.resolution' is missing",
        "imu.yaml: key 'gyroscope_random_walk' is missing", "key 'T_i_b': expected the identity",
        "key 'accelerometer_noise_density': refused for imu.accel_noise_density",
        "key 'imu.accelerometer_random_walk': stands beside kalibr", "key 'camera.intrinsics': stands beside kalibr",
        "camera.rate_hz"}) {
    EXPECT_TRUE(names(what)) << what;
  }
  EXPECT_EQ(faults_.size(), 10U) << testing::PrintToString(faults_);
}

TEST_F(KalibrTest, NamesFilesAndCamerasThatAreNotThere) {
  read("imu:\n  device: /dev/ttyS1\n  kalibr: imu.yaml\n" + kCameraSection + "  kalibr_camera: cam1\n");
  EXPECT_TRUE(names("flight.yaml line 3: key 'imu.kalibr': " + (folder_.path() / "imu.yaml").string() + " is no file"));
  EXPECT_TRUE(names("camchain-imucam.yaml: key 'cam1' is missing"));
  EXPECT_EQ(faults_.size(), 2U) << testing::PrintToString(faults_);
  replace(camchain_, "  - [0.0, 0.0, 0.0, 1.0]\n", "");
  read(kImuSection + kCameraSection);
  EXPECT_TRUE(names("'cam0.T_cam_imu': expected 4 rows of 4 numbers"));
  camchain_ = kCamchain + "cam0: 1\n";
  read(kImuSection + kCameraSection);
  EXPECT_TRUE(names("key 'cam0': stands on line 1 already"));
}

// An OV7251 has a resolution of its own, and that is looked for where it stands.
TEST_F(KalibrTest, WhatDoesNotFitTheRestIsNamedByItsFile) {
  replace(camchain_, "[640, 480]", "[752, 480]");
  read(kImuSection + kCameraSection + "  model: ov7251\n");
  EXPECT_TRUE(names("key 'camera.kalibr': the resolution in it: expected that of an OV7251"));
}

// A log has calibration and noise of its own.
TEST_F(KalibrTest, TheTextInALogIsReadWithoutTheFiles) {
  std::vector<std::string> faults;
  const FlightSetup setup =
      read_flight_config("log", kImuSection + "  rate_hz: 500\n  filter_hz: 131\n" + kCameraSection, faults);
  EXPECT_EQ(faults, std::vector<std::string>{});
  EXPECT_EQ(setup.imu.settings.rate_hz, 500);
}

}  // namespace
}  // namespace plumb
