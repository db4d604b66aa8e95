#include "config/calibration_reader.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>

#include "config/input_error.h"
#include "fsw/vision/camera_model.h"

namespace plumb {
namespace {

std::string shortest(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", value);
  return text;
}

// Why a value was refused, for the end of a message.
std::string refusal(const ParamRow<Parameters>& row) {
  std::string text = "refused for " + std::string(row.name) + "; expected ";
  if (row.kind != ParamKind::kReal) text += "a whole number ";
  text.append("from ").append(shortest(row.min)).append(" to ").append(shortest(row.max));
  if (row.unit != "1") text.append(" ").append(row.unit);
  return text;
}

void set_from(const YamlFile& yaml, const std::string& key, double value, std::string_view parameter,
              Parameters& parameters) {
  const auto [status, row] = parameter_table().set(parameters, parameter, value);
  PLUMB_ASSERT(row != nullptr);  // the names used here are the table's
  if (!ok(status)) yaml.fail(key, refusal(*row));
}

// Nothing that flies is larger; millimetres in the place of metres are.
constexpr double kLongestLever_m = 50.0;
constexpr const char* kLeverExpected = "expected a place on the vehicle, in metres (less than 50 m off)";

struct Pose {
  Mat3 rotation;
  Vec3 translation;
};

/// From a 4 x 4 homogeneous matrix by rows, under `key`.
Pose to_pose(const YamlFile& yaml, const char* key, const std::vector<double>& m) {
  constexpr double kOrthonormal = 1e-3;  // calibration files carry 6 digits or more
  Pose pose;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) pose.rotation(r, c) = m[static_cast<std::size_t>(4 * r + c)];
    pose.translation(r) = m[static_cast<std::size_t>(4 * r + 3)];
  }
  if (!(pose.translation.norm() < kLongestLever_m)) yaml.fail(key, kLeverExpected);
  const bool last_row = m[12] == 0.0 && m[13] == 0.0 && m[14] == 0.0 && m[15] == 1.0;
  const double error = (pose.rotation * pose.rotation.transpose() - Mat3::Identity()).norm();
  if (!last_row || error > kOrthonormal || pose.rotation.determinant() < 0.0) {
    yaml.fail(key, "expected a rigid transform (rotation matrix, translation, 0 0 0 1)");
  }
  return pose;
}

/// T_BS: sensor to body.
Pose read_pose(const YamlFile& yaml) { return to_pose(yaml, "T_BS.data", yaml.numbers("T_BS.data", 16)); }

/// `key`: of the coefficients.
void read_distortion(const YamlFile& yaml, const char* key, CameraCalibration& camera) {
  const std::string model = yaml.text("distortion_model");
  std::size_t count = 0;
  if (model == "radial-tangential" || model == "radtan" || model == "plumb_bob") {
    camera.distortion = Distortion::kRadialTangential;
    count = 4;
  } else if (model == "equidistant") {
    camera.distortion = Distortion::kEquidistant;
    count = 4;
  } else if (model == "fov") {
    camera.distortion = Distortion::kFov;
    count = 1;
  } else if (model == "none") {
    camera.distortion = Distortion::kNone;
    return;
  } else {
    static_cast<void>(yaml.has(key));  // that is no unknown key then
    yaml.fail("distortion_model", "expected radial-tangential, equidistant, fov or none");
  }
  const std::vector<double> values = yaml.numbers(key, count);
  for (std::size_t i = 0; i < count; ++i) camera.coefficients[i] = values[i];
}

void expect_pinhole(const YamlFile& yaml) {
  if (yaml.text("camera_model") != "pinhole") yaml.fail("camera_model", "expected pinhole");
}

void read_resolution(const YamlFile& yaml, CameraCalibration& camera) {
  constexpr double kMaxSide = 65536.0;  // px
  const std::vector<double> size = yaml.numbers("resolution", 2);
  for (const double side : size) {
    if (side < 1.0 || side > kMaxSide || side != std::floor(side)) {
      yaml.fail("resolution", "expected width and height in whole pixels");
    }
  }
  camera.width = static_cast<std::int32_t>(size[0]);
  camera.height = static_cast<std::int32_t>(size[1]);
}

void read_projection(const YamlFile& yaml, CameraCalibration& camera) {
  const std::vector<double> k = yaml.numbers("intrinsics", 4);
  camera.fx = k[0];
  camera.fy = k[1];
  camera.cx = k[2];
  camera.cy = k[3];
  if (camera.fx <= 0.0 || camera.fy <= 0.0) yaml.fail("intrinsics", "expected focal lengths above 0 px");
  const bool sized = camera.width > 0;  // else that is a fault of its own
  if (camera.cx < 0.0 || camera.cy < 0.0 || (sized && (camera.cx > camera.width || camera.cy > camera.height))) {
    yaml.fail("intrinsics", "expected a principal point within the image");
  }
}

// Half widths of the image in the normalised plane, from the middles of its four edges. A lens that sees 90 degrees or
// more off its axis has no point there: then from the outermost twentieth that has one.
void read_field_of_view(const YamlFile& yaml, const char* key, Calibration& calibration) {
  constexpr int kSteps = 20;
  const CameraCalibration& camera = calibration.camera;
  const CameraModel model(camera);
  const Vec2 centre(camera.cx, camera.cy);
  const Vec2 edges[4] = {
      {0.0, camera.cy}, {camera.width - 1.0, camera.cy}, {camera.cx, 0.0}, {camera.cx, camera.height - 1.0}};
  for (const Vec2& edge : edges) {
    Vec2 normalised;
    int step = kSteps;
    while (step > 0 && !ok(model.undistort(centre + (edge - centre) * (step / double{kSteps}), normalised))) --step;
    if (step == 0) yaml.fail(key, "expected a lens model that can be inverted somewhere in the image");
    calibration.sensor.half_fov_x = std::max(calibration.sensor.half_fov_x, std::abs(normalised.x()));
    calibration.sensor.half_fov_y = std::max(calibration.sensor.half_fov_y, std::abs(normalised.y()));
  }
  calibration.sensor.focal_px = model.focal_px();
}

/// `key`: of the coefficients.
void read_lens(const YamlFile& yaml, const char* key, Calibration& calibration, const Steps& steps) {
  CameraCalibration camera;
  int sound = 0;
  steps([&] { expect_pinhole(yaml), ++sound; });
  steps([&] { read_resolution(yaml, camera), ++sound; });
  steps([&] { read_projection(yaml, camera), ++sound; });
  steps([&] { read_distortion(yaml, key, camera), ++sound; });
  if (!yaml.has("distortion_model")) static_cast<void>(yaml.has(key));  // that is no unknown key then
  if (sound < 4) return;
  steps([&] {
    if (!ok(CameraModel::check(camera))) {
      yaml.fail("intrinsics", "expected a usable camera, with " + std::string(key) + " and resolution");
    }
    calibration.camera = camera;
    read_field_of_view(yaml, key, calibration);
  });
}

// Keys that describe the sensor to people, and T_BS, which the camera's reader takes from the IMU's file as well.
void warn_of_unused(const YamlFile& yaml, std::vector<std::string>& warnings) {
  const std::vector<std::string> unused = yaml.unused_keys({"sensor_type", "comment", "rate_hz", "T_BS"});
  warnings.insert(warnings.end(), unused.begin(), unused.end());
}

void read_node(const YamlFile& yaml, const YAML::Node& node, const std::string& prefix, Parameters& parameters,
               const Steps& steps) {
  for (const auto& entry : node) {
    const std::string name = prefix + entry.first.as<std::string>();
    if (entry.second.IsMap()) {
      read_node(yaml, entry.second, name + ".", parameters, steps);
      continue;
    }
    steps([&] {
      double value = 0.0;
      bool flag = false;
      if (entry.second.IsScalar() && YAML::convert<bool>::decode(entry.second, flag)) {
        value = flag ? 1.0 : 0.0;
      } else if (!entry.second.IsScalar() || !YAML::convert<double>::decode(entry.second, value)) {
        yaml.fail_at(entry.second, name, "expected a number");
      }
      const auto [status, row] = parameter_table().set(parameters, name, value);
      if (row == nullptr) yaml.fail_at(entry.second, name, "no parameter has this name (see --list-params)");
      if (!ok(status)) yaml.fail_at(entry.second, name, refusal(*row));
    });
  }
}

}  // namespace

void read_camera(const YamlFile* camera, const YamlFile* imu, Calibration& calibration, const Steps& steps) {
  Pose camera_pose{Mat3::Identity(), Vec3::Zero()};
  Pose imu_pose = camera_pose;
  if (camera != nullptr) {
    read_lens(*camera, "distortion_coefficients", calibration, steps);
    steps([&] { camera_pose = read_pose(*camera); });
  }
  if (imu != nullptr) steps([&] { imu_pose = read_pose(*imu); });
  calibration.sensor.q_IC = Quat(Mat3(imu_pose.rotation.transpose() * camera_pose.rotation)).normalized();
  calibration.sensor.p_IC_m = imu_pose.rotation.transpose() * (camera_pose.translation - imu_pose.translation);
}

// T_cam_imu takes points from the IMU's frame to the camera's.
Duration read_kalibr_camera(const YamlFile& yaml, Calibration& calibration, const Steps& steps) {
  read_lens(yaml, "distortion_coeffs", calibration, steps);
  steps([&] {
    const Pose pose = to_pose(yaml, "T_cam_imu", yaml.matrix("T_cam_imu", 4, 4));
    calibration.sensor.q_IC = Quat(Mat3(pose.rotation.transpose())).normalized();
    calibration.sensor.p_IC_m = -pose.rotation.transpose() * pose.translation;
  });
  Duration shift;
  steps([&] {
    constexpr double kLargestShift_s = 1.0;
    const double shift_s = yaml.optional_number("timeshift_cam_imu").value_or(0.0);
    if (!(std::abs(shift_s) <= kLargestShift_s)) yaml.fail("timeshift_cam_imu", "expected -1 to 1, in seconds");
    shift = Duration::from_seconds(shift_s);
  });
  return shift;
}

void read_kalibr_imu(const YamlFile& file, Parameters& parameters, const Steps& steps) {
  const YamlFile yaml = file.has("imu0") ? file.section("imu0") : file;
  read_imu_noise(yaml, parameters, steps);
  steps([&] {
    if (!yaml.has("T_i_b")) return;
    const Pose pose = to_pose(yaml, "T_i_b", yaml.matrix("T_i_b", 4, 4));
    constexpr double kNone = 1e-9;
    if ((pose.rotation - Mat3::Identity()).norm() + pose.translation.norm() > kNone) {
      yaml.fail("T_i_b", "expected the identity: the IMU that the camera's T_cam_imu is about");
    }
  });
}

void read_imu_noise(const YamlFile& yaml, Parameters& parameters, const Steps& steps) {
  constexpr const char* kKeys[][2] = {{"gyroscope_noise_density", "imu.gyro_noise_density"},
                                      {"gyroscope_random_walk", "imu.gyro_bias_walk"},
                                      {"accelerometer_noise_density", "imu.accel_noise_density"},
                                      {"accelerometer_random_walk", "imu.accel_bias_walk"}};
  for (const auto& [key, parameter] : kKeys) {
    steps([&] { set_from(yaml, key, yaml.number(key), parameter, parameters); });
  }
}

void read_imu_options(const YamlFile& yaml, Parameters& parameters, const Steps& steps) {
  constexpr const char* kOptionalKeys[][2] = {{"gyroscope_bias_stddev", "start.gyro_bias_sigma"},
                                              {"accelerometer_bias_stddev", "start.accel_bias_sigma"},
                                              {"gravity_mps2", "imu.gravity"}};
  for (const auto& [key, parameter] : kOptionalKeys) {
    steps([&] {
      const std::optional<double> value = yaml.optional_number(key);
      if (value) set_from(yaml, key, *value, parameter, parameters);
    });
  }
}

void read_imu(const YamlFile& yaml, Parameters& parameters, const Steps& steps) {
  read_imu_noise(yaml, parameters, steps);
  read_imu_options(yaml, parameters, steps);
}

void read_range_finder(const YamlFile& yaml, Calibration& calibration, Parameters& parameters, const Steps& steps) {
  steps([&] { set_from(yaml, "noise_stddev_m", yaml.number("noise_stddev_m"), "range.noise", parameters); });
  steps([&] { set_from(yaml, "max_range_m", yaml.number("max_range_m"), "range.max_range", parameters); });
  steps([&] {
    const std::vector<double> axis = yaml.numbers("axis_in_cam", 3);
    const Vec3 u_C(axis[0], axis[1], axis[2]);
    constexpr double kUnit = 1e-3;
    if (std::abs(u_C.norm() - 1.0) > kUnit) yaml.fail("axis_in_cam", "expected a vector of length 1");
    if (u_C.z() <= 0.0) {
      yaml.fail("axis_in_cam", "expected a beam that leaves ahead of the lens (third number above 0)");
    }
    calibration.sensor.u_C = u_C.normalized();
  });
  steps([&] {
    const std::vector<double> origin = yaml.numbers("origin_in_cam_m", 3);
    calibration.sensor.p_CR_m = Vec3(origin[0], origin[1], origin[2]);
    if (!(calibration.sensor.p_CR_m.norm() < kLongestLever_m)) yaml.fail("origin_in_cam_m", kLeverExpected);
  });
}

void read_parameters(const YamlFile& yaml, Parameters& parameters, const Steps& steps) {
  Parameters changed = parameters;  // all or nothing
  read_node(yaml, yaml.root(), "", changed, steps);
  for (const char* conflict : conflicts_in(changed)) {
    steps([&] { throw InputError(yaml.name() + ": " + conflict); });
  }
  parameters = changed;
}

void read_camera(const std::filesystem::path& cam0, const std::filesystem::path& imu0, Calibration& calibration,
                 std::vector<std::string>& warnings) {
  const YamlFile camera(cam0 / "sensor.yaml");
  const YamlFile imu(imu0 / "sensor.yaml");
  read_camera(&camera, &imu, calibration);
  warn_of_unused(camera, warnings);
}

void read_imu(const std::filesystem::path& imu0, Parameters& parameters, std::vector<std::string>& warnings) {
  const YamlFile yaml(imu0 / "sensor.yaml");
  read_imu(yaml, parameters);
  warn_of_unused(yaml, warnings);
}

void read_range_finder(const std::filesystem::path& range0, Calibration& calibration, Parameters& parameters,
                       std::vector<std::string>& warnings) {
  const YamlFile yaml(range0 / "sensor.yaml");
  read_range_finder(yaml, calibration, parameters);
  warn_of_unused(yaml, warnings);
}

void read_direction_sensor(const std::filesystem::path& folder, DirectionSource source, Parameters& parameters,
                           std::vector<std::string>& warnings) {
  const YamlFile yaml(folder / "sensor.yaml");
  const char* parameter = source == DirectionSource::kSun ? "direction.sun_noise" : "direction.magnetometer_noise";
  set_from(yaml, "noise_stddev_rad", yaml.number("noise_stddev_rad"), parameter, parameters);
  warn_of_unused(yaml, warnings);
}

void read_parameters(const std::filesystem::path& file, Parameters& parameters) {
  read_parameters(YamlFile(file), parameters);
}

}  // namespace plumb
