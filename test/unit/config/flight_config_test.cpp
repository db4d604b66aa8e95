#include "config/flight_config.h"

#include <gtest/gtest.h>

#include "test/unit/config/sound_config.h"

namespace plumb {
namespace {

using test::faults_of;
using test::kSound;
using test::names;
using test::with;
using test::with_all;

TEST(FlightConfig, ReadsDevicesCalibrationAndParameters) {
  std::vector<std::string> faults;
  const FlightSetup setup = read_flight_config("flight.yaml", kSound, faults);
  EXPECT_EQ(faults, std::vector<std::string>{});
  EXPECT_EQ(setup.text, kSound);
  EXPECT_EQ(setup.commands, CommandAccess::kNetwork);
  EXPECT_EQ(setup.imu.device, "/dev/ttyS1");
  EXPECT_EQ(setup.camera.exposure, Duration::from_ms(4));
  EXPECT_EQ(setup.calibration.camera.fx, 400.0);
  EXPECT_NEAR(setup.calibration.sensor.p_IC_m.x(), 0.5, 1e-12);
  EXPECT_EQ(setup.range.kind, RangeDevice::kCan);
  EXPECT_EQ(setup.range.can.node_id, 42);
  EXPECT_EQ(setup.range.node_status.node_id, 21);
  EXPECT_EQ(setup.calibration.sensor.p_CR_m.y(), 0.02);
  EXPECT_EQ(setup.parameters.estimator.imu.gyro_noise_density, 1e-4);
  EXPECT_EQ(setup.parameters.estimator.vision.pixel_noise_px, 0.8);
  EXPECT_EQ(setup.threads[static_cast<std::size_t>(FlightThread::kTick)].priority, 90);
  EXPECT_EQ(setup.threads[static_cast<std::size_t>(FlightThread::kTick)].core, 3);
  EXPECT_EQ(setup.threads[static_cast<std::size_t>(FlightThread::kNav)].core, -1);
}

TEST(FlightConfig, FliesWithoutARangeFinder) {
  const std::size_t at = kSound.find("range:");
  std::vector<std::string> faults;
  const FlightSetup setup =
      read_flight_config("flight.yaml", kSound.substr(0, at) + kSound.substr(kSound.find("parameters:")), faults);
  EXPECT_EQ(faults, std::vector<std::string>{});
  EXPECT_EQ(setup.range.kind, RangeDevice::kNone);
  EXPECT_FALSE(setup.parameters.estimator.range.enabled);
}

TEST(FlightConfig, NamesEveryFaultAtOnce) {
  std::string text = with("intrinsics: [400, 410, 319.5, 239.5]", "intrinsics: [400, -410, 319.5, 239.5]");
  const auto spoil = [&text](const std::string& piece, const std::string& by) {
    text.replace(text.find(piece), piece.size(), by);
  };
  spoil("resolution: [640, 480]", "resolution: [640]");
  spoil("device: /dev/ttyS1", "deivce: /dev/ttyS1");
  spoil("node_id: 42", "node_id: 128");
  spoil("gyroscope_random_walk: 2e-5", "gyroscope_random_walk: much");
  spoil("vision.pixel_noise: 0.8", "vision.pixel_noise: -1");
  spoil("axis_in_cam: [0, 0, 1]", "axis_in_cam: [0, 0, 2]");
  spoil("core: 3", "core: 3.5");
  const std::vector<std::string> faults = faults_of(text);
  for (const char* what :
       {"camera.intrinsics", "camera.resolution", "'imu.device' is missing", "imu.deivce", "range.node_id",
        "imu.gyroscope_random_walk", "vision.pixel_noise", "range.axis_in_cam", "threads.tick.core"}) {
    EXPECT_TRUE(names(faults, what)) << what;
  }
  EXPECT_EQ(faults.size(), 9U);
}

TEST(FlightConfig, AKeyThatStandsTwiceHidesNoOtherFault) {
  const std::vector<std::string> faults = faults_of(with_all({{"rate_hz: 20", "rate_hz: 20\n  rate_hz: 30"},
                                                              {"resolution: [640, 480]", "resolution: [640]"},
                                                              {"max_range_m: 40", "max_range_m: -40"}}) +
                                                    "range:\n  node_id: 7\n  latency_ms: -1\n? [a, b]\n: 1\n");
  for (const char* what :
       {"flight.yaml line 15: key 'camera.rate_hz': stands on line 14 already; expected once, found '30'",
        "flight.yaml line 34: key 'range': stands on line 22 already; expected once, found keys and values",
        "key 'range.node_id': stands on line 24 already; expected once, found '7'",
        "line 36: key 'range.latency_ms': expected 0 to 1000, found '-1'",
        "line 37: expected keys of one word, found [a, b]",
        "line 19: key 'camera.resolution': expected a list of 2 numbers, found [640]",
        "key 'range.max_range_m': refused for range.max_range; expected from"}) {
    EXPECT_TRUE(names(faults, what)) << what;
  }
  EXPECT_EQ(faults.size(), 7U) << testing::PrintToString(faults);
}

TEST(FlightConfig, ASectionThatIsNoneHidesNoFaultOfAnother) {
  const std::size_t imu = kSound.find("imu:\n");
  const std::size_t camera = kSound.find("camera:\n");
  const std::size_t range = kSound.find("range:\n");
  std::string text = kSound;
  text.replace(imu, camera - imu, "imu: 5\n");
  text.replace(text.find("400, 410"), 8, "400, -41");
  text.replace(text.find("[0, -1,"), 7, "[0, -2,");
  text.replace(text.find("rate_hz"), 7, "rate_zh");
  text.replace(text.find("camera_model: pinhole"), 21, "camera_model: omni");
  text.replace(text.find("[640, 480]"), 10, "[640]");
  std::vector<std::string> faults = faults_of(text);
  for (const char* what :
       {"line 4: key 'imu': expected a map of keys and values, found '5'", "'camera.intrinsics'", "'camera.T_BS.data'",
        "'camera.rate_zh'", "'camera.camera_model': expected pinhole, found 'omni'",
        "'camera.resolution': expected a list of 2 numbers, found [640]"}) {
    EXPECT_TRUE(names(faults, what)) << what;
  }
  EXPECT_EQ(faults.size(), 6U) << testing::PrintToString(faults);

  text = kSound;
  text.replace(camera, range - camera, "camera: [socket]\n");
  text.replace(text.find("[1, 0, 0,"), 9, "[2, 0, 0,");
  text.replace(text.find("accel_range_g"), 13, "accel_rnage_g");
  faults = faults_of(text);
  for (const char* what :
       {"key 'camera': expected a map of keys and values, found [socket]", "'imu.T_BS.data'", "'imu.accel_rnage_g'"}) {
    EXPECT_TRUE(names(faults, what)) << what;
  }
  EXPECT_EQ(faults.size(), 3U) << testing::PrintToString(faults);
}

TEST(FlightConfig, PartsThatDoNotFitEachOtherHideNoOtherFaultAndNoneHidesThem) {
  const std::vector<std::string> faults = faults_of(
      with_all({{"resolution: [640, 480]", "resolution: [1640, 480]"}, {"commands: network", "commands: all"}}));
  EXPECT_TRUE(names(faults, "key 'camera.resolution': expected at most 752 x 480, found [1640, 480]"));
  EXPECT_TRUE(names(faults, "key 'commands': expected off, local or network, found 'all'"));
  EXPECT_EQ(faults.size(), 2U) << testing::PrintToString(faults);
}

// An alias can hold what it stands in.
TEST(FlightConfig, AFileThatHoldsItselfIsRefused) {
  EXPECT_TRUE(names(faults_of("imu: &i\n  rate_hz: 250\n  more: *i\n"), "levels of keys"));
  EXPECT_TRUE(names(faults_of("&r {log: {}, log: *r}\n"), "levels of keys"));
  EXPECT_TRUE(names(faults_of("log: &l [*l]\n"), "key 'log': expected one word, found "));
}

TEST(FlightConfig, RefusesWhatNobodyKnows) {
  EXPECT_TRUE(names(faults_of(with("rate_hz: 20", "rate: 20")), "camera.rate"));
  EXPECT_TRUE(names(faults_of(with("lcm:", "lmc:")), "'lmc'"));
  // Of a section that stands beside one that cannot be read, too, and of none whose keys nobody came to ask for.
  std::string text = with("imu:\n", "ium:\n");
  text.replace(text.find("own_node_id: 21"), 15, "own_id: 21");
  const std::vector<std::string> faults = faults_of(text);
  EXPECT_TRUE(names(faults, "'range.own_id' is not known"));
  EXPECT_FALSE(names(faults, "'camera.")) << "whose keys are right";
}

TEST(FlightConfig, TakesCommandsOfThisHostAloneUnlessItIsToldOtherwise) {
  std::vector<std::string> faults;
  EXPECT_EQ(read_flight_config("flight.yaml", with("commands: network\n", ""), faults).commands, CommandAccess::kLocal);
  EXPECT_TRUE(names(faults_of(with("commands: network", "commands: yes")), "'commands'"));
}

TEST(FlightConfig, RefusesPartsThatDoNotFitEachOther) {
  EXPECT_TRUE(names(faults_of(with("resolution: [640, 480]", "resolution: [1640, 480]")), "752 x 480"));
  EXPECT_TRUE(names(faults_of(with("socket: /run/plumb/camera", "rate_hz: 30\n  device: /dev/video0")), "rate_hz"))
      << "twice in one map";
  EXPECT_TRUE(names(faults_of(with("can: can0", "can: can0\n  i2c: /dev/i2c-1")), "either i2c or can"));
  EXPECT_TRUE(names(faults_of(with("accel_range_g: 10", "rate_hz: 300")), "STIM300"));
}

TEST(FlightConfig, EachPairOfParametersThatDoesNotFitIsTold) {
  const std::vector<std::string> faults =
      faults_of(with("vision.pixel_noise: 0.8",
                     "vision.min_depth: 5\n  vision.max_depth: 4\n  tracker.window: 12\n"
                     "  tracker.tile_columns: 64"));
  for (const char* what :
       {"flight.yaml: vision.min_depth must be below vision.max_depth", "flight.yaml: tracker.window must be odd",
        "flight.yaml: tracker.tile_columns times tracker.tile_rows must be at most 64"}) {
    EXPECT_TRUE(names(faults, what)) << what;
  }
  EXPECT_EQ(faults.size(), 3U) << testing::PrintToString(faults);
  for (const char* sigma : {"gyro_scale_sigma", "accel_scale_sigma", "time_offset_sigma", "camera_rotation_sigma",
                            "camera_position_sigma", "beam_tilt_sigma", "beam_origin_sigma"}) {
    const std::string wanted = std::string("calibration.") + sigma + ": 0.01";
    EXPECT_TRUE(names(faults_of(with("vision.pixel_noise: 0.8", wanted)), "no room")) << sigma;
  }
  EXPECT_TRUE(names(faults_of(with_all({{"[640, 480]", "[40, 40]"},
                                        {"[400, 410, 319.5, 239.5]", "[40, 41, 19.5, 19.5]"},
                                        {"vision.pixel_noise: 0.8", "tracker.border: 18\n  tracker.window: 12"}})),
                    "too little of the image"));
}

TEST(FlightConfig, AMisspelledLensMakesItsCoefficientsNoUnknownKey) {
  const std::vector<std::string> faults =
      faults_of(with("distortion_model: none", "distortion_model: fisheyes\n  distortion_coefficients: [0, 0, 0, 0]"));
  EXPECT_EQ(faults.size(), 1U) << testing::PrintToString(faults);
}

// `range:` with nothing below it would fly without ranges.
TEST(FlightConfig, AKeyWithoutAValueIsRefused) {
  const std::size_t range = kSound.find("range:\n");
  const std::size_t parameters = kSound.find("parameters:\n");
  std::string text = kSound;
  text.replace(range, parameters - range, "range:\n");
  EXPECT_TRUE(names(faults_of(text), "line 21: key 'range': expected a value, or no such key; found nothing"));
  EXPECT_TRUE(names(faults_of(with("rate_hz: 20", "rate_hz:")), "key 'camera.rate_hz': expected a value"));
}

TEST(FlightConfig, ASecondDocumentIsRefused) {
  EXPECT_TRUE(names(faults_of(kSound + "---\nimu: 3\n"), ": expected one document, found a second"));
  EXPECT_TRUE(faults_of("# a comment\n---\n" + kSound).empty());
}

// The sound file with such a camera.
std::string with_camera(const std::string& keys) { return with("socket: /run/plumb/camera", keys); }
std::string with_automatic_exposure(const std::string& keys) {
  return with_all(
      {{"socket: /run/plumb/camera", "device: /dev/video0\n  model: ov7251\n  " + keys}, {"  exposure_ms: 4\n", ""}});
}

TEST(FlightConfig, ReadsTriggerAndAutomaticExposure) {
  std::vector<std::string> faults;
  const CameraSetup camera =
      read_flight_config("flight.yaml",
                         with_automatic_exposure("trigger: external\n  trigger_control: 0x00981234\n"
                                                 "  longest_exposure_ms: 2.5\n  target_brightness: 60"),
                         faults)
          .camera;
  EXPECT_EQ(faults, std::vector<std::string>{});
  EXPECT_EQ(camera.trigger, CameraTrigger::kExternal);
  EXPECT_EQ(camera.trigger_control, 0x00981234U);
  EXPECT_EQ(camera.longest_exposure, Duration::from_us(2500));
  EXPECT_EQ(camera.target_brightness, 60.0);
  EXPECT_EQ(faults_of(with_camera("socket: /run/plumb/camera\n  trigger: external")), std::vector<std::string>{})
      << "a daemon needs no control";
  EXPECT_EQ(faults_of(with_camera("device: /dev/video0\n  trigger_control: 9966132")), std::vector<std::string>{})
      << "it is told that there is no trigger";
}

TEST(FlightConfig, RefusesCameraKeysOutOfRangeOrWithoutEffect) {
  for (const auto& [keys, fault] : std::vector<std::pair<std::string, std::string>>{
           {"trigger: edge", "flight.yaml line 15: key 'camera.trigger': expected free_run or external, found 'edge'"},
           {"trigger: external", "key 'camera.trigger': stands without trigger_control"},
           {"trigger_control: 7", "'camera.trigger_control': expected the number of a control"},
           {"trigger_control: 0x00981234h", "'camera.trigger_control': expected the number of a control"},
           {"trigger_control: 0x80981234", "'camera.trigger_control': expected the number of a control"},
           {"longest_exposure_ms: 33", "'camera.longest_exposure_ms': expected 0.019333 to 32.9434, found '33'"},
           {"longest_exposure_ms: 0", "'camera.longest_exposure_ms': expected 0.019333 to 32.9434, found '0'"},
           {"target_brightness: 19", "'camera.target_brightness': expected 20 to 200, found '19'"},
           {"longest_exposure_ms: 5\n  exposure_ms: 4", "'camera.longest_exposure_ms': stands beside exposure_ms"},
           {"target_brightness: 90\n  exposure_ms: 4", "'camera.target_brightness': stands beside exposure_ms"},
           {"readout_ms: 9", "'camera.readout_ms': stands beside model: ov7251"}}) {
    const std::vector<std::string> faults = faults_of(with_automatic_exposure(keys));
    EXPECT_TRUE(names(faults, fault)) << keys << ": " << testing::PrintToString(faults);
    EXPECT_EQ(faults.size(), 1U) << keys << ": " << testing::PrintToString(faults);
  }
  for (const auto& [keys, fault] : std::vector<std::pair<std::string, std::string>>{
           {"trigger_control: 0x00981234", "'camera.trigger_control': stands without device"},
           {"subdevice: /dev/v4l-subdev0", "'camera.subdevice': stands without device"},
           {"longest_exposure_ms: 5", "'camera.longest_exposure_ms': stands without model: ov7251"},
           {"target_brightness: 90", "'camera.target_brightness': stands without model: ov7251"}}) {
    const std::vector<std::string> faults = faults_of(with_camera("socket: /run/plumb/camera\n  " + keys));
    EXPECT_TRUE(names(faults, fault)) << keys << ": " << testing::PrintToString(faults);
    EXPECT_EQ(faults.size(), 1U) << keys;
  }
}

TEST(FlightConfig, TextThatIsNoYamlIsOneFault) {
  EXPECT_EQ(faults_of("log: [").size(), 1U);
  EXPECT_EQ(faults_of("").size(), 1U);
}

}  // namespace
}  // namespace plumb
