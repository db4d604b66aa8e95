#include "config/flight_config.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <limits>
#include <optional>
#include <sstream>

#include "config/input_error.h"
#include "config/yaml_file.h"
#include "drivers/ov7251/sensor.h"
#include "fsw/base/mission_config.h"
#include "fsw/vision/tracker_options.h"

namespace plumb {
namespace {

class Reader {
 public:
  /// `folder`: where files are that the configuration names; null: nowhere.
  Reader(const YamlFile& file, const std::filesystem::path* folder, std::vector<std::string>& faults)
      : file_(file), folder_(folder), faults_(faults) {}

  FlightSetup read() {
    steps_([&] { setup_.log = file_.text_or("log", ""); });
    steps_([&] { setup_.lcm_url = file_.text_or("lcm", ""); });
    steps_([&] { setup_.commands = access(file_.text_or("commands", "local")); });
    std::optional<YamlFile> imu = section("imu");
    std::optional<YamlFile> camera = section("camera");
    if (imu) read_imu_section(*imu);
    read_calibration(camera ? &*camera : nullptr, imu ? &*imu : nullptr);
    if (camera) read_camera_section(*camera);
    std::optional<YamlFile> range;
    if (file_.has("range")) range = section("range");
    if (range) read_range_section(*range);
    setup_.parameters.estimator.range.enabled = range.has_value();
    if (file_.has("parameters")) {
      if (const auto parameters = section("parameters")) read_parameters(*parameters, setup_.parameters, steps_);
    }
    if (file_.has("threads")) {
      if (const auto threads = section("threads")) read_threads(*threads);
    }
    if (imu) refuse_unknown(*imu);
    if (camera) refuse_unknown(*camera);
    // The keys of a range finder are asked for by its kind.
    if (range && (range->has("i2c") || range->has("can"))) refuse_unknown(*range);
    refuse_unknown(file_);
    if (setup_.calibration.camera.width > 0) check_whole();
    return setup_;
  }

 private:
  std::optional<YamlFile> section(const std::string& key) {
    std::optional<YamlFile> section;
    steps_([&] { section = file_.section(key); });
    return section;
  }

  void refuse_unknown(const YamlFile& yaml) {
    // Keys that describe a sensor to people.
    for (const std::string& sentence : yaml.unused_keys({"sensor_type", "comment"})) faults_.push_back(sentence);
  }

  /// A number from `min` to `max`, or `value` where the key is missing.
  static double number(const YamlFile& yaml, const char* key, double value, double min, double max) {
    const double found = yaml.optional_number(key).value_or(value);
    if (found >= min && found <= max) return found;
    std::ostringstream expected;
    expected << "expected " << min << " to " << max;
    yaml.fail(key, expected.str());
  }
  static int whole(const YamlFile& yaml, const char* key, int value, int min, int max) {
    const double found = number(yaml, key, value, min, max);
    if (found != std::floor(found)) yaml.fail(key, "expected a whole number");
    return static_cast<int>(found);
  }
  static Duration milliseconds(const YamlFile& yaml, const char* key, double value) {
    return Duration::from_seconds(1e-3 * number(yaml, key, value, 0.0, 1000.0));
  }

  CommandAccess access(const std::string& word) const {
    if (word == "off") return CommandAccess::kOff;
    if (word == "local") return CommandAccess::kLocal;
    if (word == "network") return CommandAccess::kNetwork;
    file_.fail("commands", "expected off, local or network");
  }

  void read_imu_section(const YamlFile& yaml) {
    stim300::Settings& settings = setup_.imu.settings;
    steps_([&] { setup_.imu.device = yaml.text("device"); });
    steps_([&] { settings.baud = static_cast<std::uint32_t>(whole(yaml, "baud", 921600, 1200, 10'000'000)); });
    steps_([&] { settings.rate_hz = whole(yaml, "rate_hz", settings.rate_hz, 125, 2000); });
    steps_([&] { settings.accel_range_g = whole(yaml, "accel_range_g", settings.accel_range_g, 5, 80); });
    steps_([&] {
      settings.gyro_filter_hz = settings.accel_filter_hz = whole(yaml, "filter_hz", settings.gyro_filter_hz, 16, 262);
    });
    steps_([&] {
      if (!stim300::is_usable(settings)) {
        yaml.fail("rate_hz", "expected, with filter_hz, accel_range_g and baud, a setting that a STIM300 can fly with");
      }
    });
    read_imu_options(yaml, setup_.parameters, steps_);
    if (!yaml.has("kalibr")) return read_imu_noise(yaml, setup_.parameters, steps_);
    refuse_beside_kalibr(yaml, {"gyroscope_noise_density", "gyroscope_random_walk", "accelerometer_noise_density",
                                "accelerometer_random_walk"});
    steps_([&] {
      if (const auto file = kalibr_file(yaml)) read_kalibr_imu(*file, setup_.parameters, steps_);
    });
  }

  /// What is wrong with it names the key, unless the file itself is there.
  std::optional<YamlFile> kalibr_file(const YamlFile& yaml) {
    const std::string name = yaml.text("kalibr");
    if (folder_ == nullptr) return std::nullopt;
    const std::filesystem::path path = *folder_ / name;
    if (!std::filesystem::is_regular_file(path)) yaml.fail("kalibr", path.string() + " is no file; expected one");
    return YamlFile(path, &faults_);
  }

  void refuse_keys(const YamlFile& yaml, std::initializer_list<const char*> keys, const char* why) {
    for (const char* key : keys) {
      steps_([&] {
        if (yaml.has(key)) yaml.fail(key, why);
      });
    }
  }

  void refuse_beside_kalibr(const YamlFile& yaml, std::initializer_list<const char*> keys) {
    refuse_keys(yaml, keys, "stands beside kalibr, whose file has it; expected one of the two");
  }

  /// Null: a section that cannot be read, which is a fault already.
  void read_calibration(const YamlFile* camera, const YamlFile* imu) {
    if (camera == nullptr && imu != nullptr && !imu->has("T_BS")) return;  // may be right, for a camera of Kalibr
    if (camera == nullptr || !camera->has("kalibr")) return read_camera(camera, imu, setup_.calibration, steps_);
    refuse_beside_kalibr(
        *camera, {"T_BS", "camera_model", "resolution", "intrinsics", "distortion_model", "distortion_coefficients"});
    if (imu != nullptr) refuse_beside_kalibr(*imu, {"T_BS"});
    steps_([&] {
      const std::string name = camera->text_or("kalibr_camera", "cam0");
      if (const auto file = kalibr_file(*camera)) {
        setup_.camera.shift = read_kalibr_camera(file->section(name), setup_.calibration, steps_);
      }
    });
  }

  void read_camera_section(const YamlFile& yaml) {
    CameraSetup& camera = setup_.camera;
    steps_([&] { camera.device = yaml.text_or("device", ""); });
    steps_([&] { camera.subdevice = yaml.text_or("subdevice", ""); });
    steps_([&] {
      const std::string model = yaml.text_or("model", "any");
      camera.is_ov7251 = model == "ov7251";
      if (!camera.is_ov7251 && model != "any") yaml.fail("model", "expected ov7251 or any");
    });
    steps_([&] { camera.socket = yaml.text_or("socket", ""); });
    steps_([&] {
      if (camera.device.empty() == camera.socket.empty()) yaml.fail("device", "expected either device or socket");
    });
    steps_([&] { camera.rate_hz = number(yaml, "rate_hz", camera.rate_hz, 1.0, 200.0); });
    steps_([&] { camera.exposure = milliseconds(yaml, "exposure_ms", 0.0); });
    steps_([&] { camera.readout = milliseconds(yaml, "readout_ms", 0.0); });
    steps_([&] { camera.latency = milliseconds(yaml, "latency_ms", 0.0); });
    steps_([&] { read_trigger(yaml); });
    steps_([&] { read_trigger_control(yaml); });
    steps_([&] {
      constexpr Duration kMost = ov7251::kLineTime * (ov7251::kFrameLines.front() - ov7251::kUnexposedLines);
      refuse_without_auto_exposure(yaml, "longest_exposure_ms");
      camera.longest_exposure =
          Duration::from_seconds(1e-3 * number(yaml, "longest_exposure_ms", 1e3 * camera.longest_exposure.seconds(),
                                               1e3 * ov7251::kLineTime.seconds(), 1e3 * kMost.seconds()));
    });
    steps_([&] {
      refuse_without_auto_exposure(yaml, "target_brightness");
      camera.target_brightness =
          number(yaml, "target_brightness", camera.target_brightness, ov7251::kMinTarget, ov7251::kMaxTarget);
    });
  }

  void read_trigger(const YamlFile& yaml) {
    const std::string word = yaml.text_or("trigger", "free_run");
    if (word != "free_run" && word != "external") yaml.fail("trigger", "expected free_run or external");
    if (word == "free_run") return;
    setup_.camera.trigger = CameraTrigger::kExternal;
    if (setup_.camera.socket.empty() && !yaml.has("trigger_control")) {
      yaml.fail("trigger", "stands without trigger_control, which Video4Linux needs for it; expected both");
    }
  }

  void read_trigger_control(const YamlFile& yaml) {
    if (!yaml.has("trigger_control")) return;
    if (setup_.camera.device.empty()) {
      yaml.fail("trigger_control", "stands without device, of whose driver it is a control; expected device");
    }
    // A V4L2 control has the number of its class in the upper bits, and the highest bits are flags.
    constexpr std::uint32_t kLeast = 0x0098'0000;
    constexpr std::uint32_t kMost = 0x0fff'ffff;
    const std::string text = yaml.text("trigger_control");
    const bool is_hexadecimal = text.starts_with("0x");
    const char* const end = text.data() + text.size();
    std::uint32_t id = 0;
    const auto [rest, error] =
        std::from_chars(text.data() + (is_hexadecimal ? 2 : 0), end, id, is_hexadecimal ? 16 : 10);
    if (error != std::errc() || rest != end || id < kLeast || id > kMost) {
      yaml.fail("trigger_control", "expected the number of a control, 0x00980000 to 0x0fffffff");
    }
    setup_.camera.trigger_control = id;
  }

  /// For keys that only the automatic exposure of Plumb heeds.
  void refuse_without_auto_exposure(const YamlFile& yaml, const char* key) const {
    if (!yaml.has(key)) return;
    if (!setup_.camera.is_ov7251) yaml.fail(key, "stands without model: ov7251; expected it only with that");
    if (setup_.camera.exposure > Duration()) {
      yaml.fail(key, "stands beside exposure_ms, which fixes the exposure; expected one of the two");
    }
  }

  void read_range_section(const YamlFile& yaml) {
    RangeSetup& range = setup_.range;
    const bool lidar_lite = yaml.has("i2c");
    const bool can = yaml.has("can");
    steps_([&] {
      if (lidar_lite == can) yaml.fail("i2c", "expected either i2c or can");
      range.kind = lidar_lite ? RangeDevice::kLidarLite : RangeDevice::kCan;
      range.device = yaml.text(lidar_lite ? "i2c" : "can");
    });
    if (can) read_can_range(yaml);
    if (lidar_lite) read_lidar_lite(yaml, !can);
    read_range_finder(yaml, setup_.calibration, setup_.parameters, steps_);
  }

  /// `alone`: no other device stands beside it, of which there can be only one.
  void read_lidar_lite(const YamlFile& yaml, bool alone) {
    lidar_lite::Options& options = setup_.range.lidar_lite;
    steps_([&] {
      if (!alone && !yaml.has("model")) return;
      const std::string model = yaml.text("model");
      if (model == "v3")
        options.model = lidar_lite::Model::kV3;
      else if (model == "v3hp")
        options.model = lidar_lite::Model::kV3Hp;
      else if (model == "v4led")
        options.model = lidar_lite::Model::kV4Led;
      else
        yaml.fail("model", "expected v3, v3hp or v4led");
    });
    steps_([&] { options.period = milliseconds(yaml, "period_ms", 40.0); });
    steps_([&] {
      if (options.period < lidar_lite::kMinPeriod) yaml.fail("period_ms", "expected at least 10 ms");
    });
  }

  void read_can_range(const YamlFile& yaml) {
    can_range::Options& can = setup_.range.can;
    std::optional<can_range::Protocol> protocol;
    steps_([&] {
      const std::string word = yaml.text_or("protocol", "dronecan");
      if (word == "dronecan")
        protocol = can_range::Protocol::kDronecan;
      else if (word == "benewake")
        protocol = can_range::Protocol::kBenewake;
      else
        yaml.fail("protocol", "expected dronecan or benewake");
    });
    can.protocol = protocol.value_or(can.protocol);
    steps_([&] { can.bus_bit_s = whole(yaml, "bus_bit_s", can.bus_bit_s, 10'000, 1'000'000); });
    steps_([&] { can.latency = milliseconds(yaml, "latency_ms", 0.0); });
    // Beside a protocol that is not known, the keys of either may be right.
    if (protocol == can_range::Protocol::kBenewake) {
      refuse_keys(yaml, {"node_id", "sensor_id", "own_node_id"},
                  "stands beside protocol: benewake; expected only beside protocol: dronecan");
    } else {
      read_dronecan(yaml);
    }
    if (protocol == can_range::Protocol::kDronecan) {
      refuse_keys(yaml, {"can_id", "far_cm", "min_strength"},
                  "stands beside protocol: dronecan; expected only beside protocol: benewake");
    } else {
      read_benewake(yaml);
    }
  }

  void read_dronecan(const YamlFile& yaml) {
    RangeSetup& range = setup_.range;
    steps_([&] { range.can.node_id = whole(yaml, "node_id", range.can.node_id, can_range::kAny, 127); });
    steps_([&] { range.can.sensor_id = whole(yaml, "sensor_id", range.can.sensor_id, can_range::kAny, 255); });
    steps_([&] {
      if (range.can.node_id == 0) yaml.fail("node_id", "expected 1 to 127, or -1 for any");
    });
    steps_([&] {
      const int id = whole(yaml, "own_node_id", range.node_status.node_id, 1, can_range::kMaxNodeId);
      if (id == range.can.node_id) yaml.fail("own_node_id", "expected another than the sensor's node_id");
      range.node_status.node_id = static_cast<std::uint8_t>(id);
    });
  }

  void read_benewake(const YamlFile& yaml) {
    can_range::Options& can = setup_.range.can;
    constexpr int kMaxWord = std::numeric_limits<std::uint16_t>::max();
    steps_([&] {
      can.benewake_id = static_cast<std::uint32_t>(
          whole(yaml, "can_id", static_cast<int>(can.benewake_id), 0, static_cast<int>(kCanStandardIdMask)));
    });
    steps_([&] {
      can.benewake_far_cm = static_cast<std::uint16_t>(
          whole(yaml, "far_cm", can.benewake_far_cm, can_range::kMinBenewakeFar_cm, kMaxWord));
    });
    steps_([&] {
      can.benewake_min_strength =
          static_cast<std::uint16_t>(whole(yaml, "min_strength", can.benewake_min_strength, 0, kMaxWord));
    });
  }

  void read_threads(const YamlFile& yaml) {
    for (std::size_t i = 0; i < kFlightThreadNames.size(); ++i) {
      const char* name = kFlightThreadNames[i];
      if (!yaml.has(name)) continue;
      steps_([&] {
        const YamlFile thread = yaml.section(name);
        ThreadSetup& setup = setup_.threads[i];
        steps_([&] { setup.priority = whole(thread, "priority", setup.priority, 0, 99); });
        steps_([&] { setup.core = whole(thread, "core", setup.core, -1, 1023); });
        refuse_unknown(thread);
      });
    }
    refuse_unknown(yaml);
  }

  [[noreturn]] void fail_resolution(const std::string& message) const {
    const YamlFile camera = file_.section("camera");
    const bool kalibr = camera.has("kalibr");
    camera.fail(kalibr ? "kalibr" : "resolution", (kalibr ? "the resolution in it: " : "") + message);
  }

  /// What each part cannot see by itself.
  void check_whole() {
    const CameraCalibration& camera = setup_.calibration.camera;
    steps_([&] {
      if (setup_.camera.is_ov7251 && (camera.width != ov7251::kWidth || camera.height != ov7251::kHeight)) {
        fail_resolution("expected that of an OV7251, 640 x 480");
      }
    });
    steps_([&] {
      if (camera.width > static_cast<std::int32_t>(FlightConfig::kMaxImageWidth) ||
          camera.height > static_cast<std::int32_t>(FlightConfig::kMaxImageHeight)) {
        fail_resolution("expected at most " + std::to_string(FlightConfig::kMaxImageWidth) + " x " +
                        std::to_string(FlightConfig::kMaxImageHeight));
      }
    });
    for (const char* conflict : conflicts_in(setup_.parameters)) {
      const std::string fault = file_.name() + ": " + conflict;
      if (std::find(faults_.begin(), faults_.end(), fault) == faults_.end()) faults_.push_back(fault);
    }
    if (!TrackerOptions::has_room(setup_.parameters.tracker, camera)) {
      faults_.push_back(file_.name() + ": " + kTrackerNeedsRoom);
    }
  }

  const YamlFile& file_;
  const std::filesystem::path* folder_;
  std::vector<std::string>& faults_;
  FlightSetup setup_;
  const Steps steps_ = [this](const std::function<void()>& step) {
    try {
      step();
    } catch (const InputError& fault) {
      faults_.push_back(fault.what());
    }
  };
};

FlightSetup read_text(const std::string& name, const std::string& text, const std::filesystem::path* folder,
                      std::vector<std::string>& faults) {
  FlightSetup setup;
  try {
    const YamlFile file(name, text, &faults);
    setup = Reader(file, folder, faults).read();
  } catch (const InputError& fault) {  // it is no YAML at all, or has no end
    faults.push_back(fault.what());
  }
  setup.text = text;
  return setup;
}

}  // namespace

FlightSetup read_flight_config(const std::string& name, const std::string& text, std::vector<std::string>& faults) {
  return read_text(name, text, nullptr, faults);
}

FlightSetup read_flight_config(const std::filesystem::path& file, std::vector<std::string>& faults) {
  const bool is_file = std::filesystem::is_regular_file(file);  // to open a pipe would wait for who writes
  std::ifstream stream;
  if (is_file) stream.open(file);
  if (!stream.is_open()) {
    faults.push_back(file.string() + ": cannot be read; expected a YAML file");
    return {};
  }
  std::ostringstream text;
  text << stream.rdbuf();
  const std::filesystem::path folder = file.parent_path();
  return read_text(file.string(), text.str(), &folder, faults);
}

}  // namespace plumb
