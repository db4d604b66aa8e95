#include "config/flight_config.h"

#include <algorithm>
#include <charconv>
#include <fstream>
#include <optional>
#include <sstream>

#include "config/input_error.h"
#include "config/range_section.h"
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
    if (range) read_range_section(*range, setup_, steps_);
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

  CommandAccess access(const std::string& word) const {
    if (word == "off") return CommandAccess::kOff;
    if (word == "local") return CommandAccess::kLocal;
    if (word == "network") return CommandAccess::kNetwork;
    file_.fail("commands", "expected off, local or network");
  }

  void read_imu_section(const YamlFile& yaml) {
    stim300::Settings& settings = setup_.imu.settings;
    steps_([&] { setup_.imu.device = yaml.text("device"); });
    steps_([&] { settings.baud = static_cast<std::uint32_t>(whole_in(yaml, "baud", 921600, 1200, 10'000'000)); });
    steps_([&] { settings.rate_hz = whole_in(yaml, "rate_hz", settings.rate_hz, 125, 2000); });
    steps_([&] { settings.accel_range_g = whole_in(yaml, "accel_range_g", settings.accel_range_g, 5, 80); });
    steps_([&] {
      settings.gyro_filter_hz = settings.accel_filter_hz =
          whole_in(yaml, "filter_hz", settings.gyro_filter_hz, 16, 262);
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

  void refuse_beside_kalibr(const YamlFile& yaml, std::initializer_list<const char*> keys) {
    refuse_keys(yaml, keys, "stands beside kalibr, whose file has it; expected one of the two", steps_);
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
    steps_([&] {
      const std::string model = yaml.text_or("model", "any");
      camera.is_ov7251 = model == "ov7251";
      if (!camera.is_ov7251 && model != "any") yaml.fail("model", "expected ov7251 or any");
    });
    steps_([&] { camera.socket = yaml.text_or("socket", ""); });
    steps_([&] {
      if (camera.device.empty() == camera.socket.empty()) yaml.fail("device", "expected either device or socket");
    });
    steps_([&] {
      camera.subdevice = yaml.text_or("subdevice", "");
      if (!camera.subdevice.empty() && camera.device.empty()) {
        yaml.fail("subdevice", "stands without device, whose sensor it is; expected device");
      }
    });
    steps_([&] { camera.rate_hz = number_in(yaml, "rate_hz", camera.rate_hz, 1.0, 200.0); });
    steps_([&] { camera.exposure = milliseconds_in(yaml, "exposure_ms", 0.0); });
    steps_([&] {
      camera.readout = milliseconds_in(yaml, "readout_ms", 0.0);
      if (camera.is_ov7251 && yaml.has("readout_ms")) {
        yaml.fail("readout_ms", "stands beside model: ov7251, whose readout is known; expected one of the two");
      }
    });
    steps_([&] { camera.latency = milliseconds_in(yaml, "latency_ms", 0.0); });
    steps_([&] { read_trigger(yaml); });
    steps_([&] { read_trigger_control(yaml); });
    steps_([&] {
      constexpr Duration kMost = ov7251::kLineTime * (ov7251::kFrameLines.front() - ov7251::kUnexposedLines);
      refuse_without_auto_exposure(yaml, "longest_exposure_ms");
      camera.longest_exposure =
          Duration::from_seconds(1e-3 * number_in(yaml, "longest_exposure_ms", 1e3 * camera.longest_exposure.seconds(),
                                                  1e3 * ov7251::kLineTime.seconds(), 1e3 * kMost.seconds()));
    });
    steps_([&] {
      refuse_without_auto_exposure(yaml, "target_brightness");
      camera.target_brightness =
          number_in(yaml, "target_brightness", camera.target_brightness, ov7251::kMinTarget, ov7251::kMaxTarget);
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

  void read_threads(const YamlFile& yaml) {
    for (std::size_t i = 0; i < kFlightThreadNames.size(); ++i) {
      const char* name = kFlightThreadNames[i];
      if (!yaml.has(name)) continue;
      steps_([&] {
        const YamlFile thread = yaml.section(name);
        ThreadSetup& setup = setup_.threads[i];
        steps_([&] { setup.priority = whole_in(thread, "priority", setup.priority, 0, 99); });
        steps_([&] { setup.core = whole_in(thread, "core", setup.core, -1, 1023); });
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
    if (!has_calibration_room<FlightConfig>(setup_.parameters.estimator.calibration)) {
      faults_.push_back(file_.name() + ": " + kCalibrationNeedsRoom);
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
