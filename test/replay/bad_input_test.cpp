// Whatever is wrong with a recording: one message that names the file, the key or line and what was expected, exit code
// 2, and no output.

#include <gtest/gtest.h>

#include <functional>

#include "test/replay/run_replay.h"
#include "test/replay/small_recording.h"

namespace plumb::test {
namespace {

namespace fs = std::filesystem;

struct BadCase {
  const char* name;
  std::function<void(const SmallRecording&)> spoil;
  const char* message;
};

std::function<void(const SmallRecording&)> replaced(const char* file, const std::string& from, const std::string& to) {
  return [=](const SmallRecording& recording) { ASSERT_TRUE(recording.replace(file, from, to)) << from; };
}

std::function<void(const SmallRecording&)> removed(const char* file) {
  return [=](const SmallRecording& recording) { fs::remove_all(recording.path() / file); };
}

constexpr const char* kCamYaml = "mav0/cam0/sensor.yaml";
constexpr const char* kImuYaml = "mav0/imu0/sensor.yaml";
constexpr const char* kRangeYaml = "mav0/range0/sensor.yaml";
constexpr const char* kCamCsv = "mav0/cam0/data.csv";
constexpr const char* kImuCsv = "mav0/imu0/data.csv";
constexpr const char* kRangeCsv = "mav0/range0/data.csv";
constexpr const char* kTruthCsv = "mav0/state_groundtruth_estimate0/data.csv";

const BadCase kCases[] = {
    {"no camera folder", removed("mav0/cam0"), "mav0/cam0: not found"},
    {"no IMU folder", removed("mav0/imu0"), "mav0/imu0: not found"},
    {"no camera yaml", removed(kCamYaml), "cam0/sensor.yaml: not found"},
    {"no IMU yaml", removed(kImuYaml), "imu0/sensor.yaml: not found"},
    {"no range yaml", removed(kRangeYaml), "range0/sensor.yaml: not found"},
    {"no image table", removed(kCamCsv), "cam0/data.csv: cannot be read"},
    {"no IMU table", removed(kImuCsv), "imu0/data.csv: cannot be read"},
    {"no intrinsics", replaced(kCamYaml, "intrinsics", "intrinsic"), "cam0/sensor.yaml: key 'intrinsics' is missing"},
    {"no pose", replaced(kCamYaml, "T_BS", "T_SB"), "cam0/sensor.yaml: key 'T_BS.data' is missing"},
    {"no noise", replaced(kImuYaml, "gyroscope_noise_density", "gyro"), "key 'gyroscope_noise_density' is missing"},
    {"no beam", replaced(kRangeYaml, "axis_in_cam", "axis"), "range0/sensor.yaml: key 'axis_in_cam' is missing"},
    {"three intrinsics", replaced(kCamYaml, "[60, 60, 47.5, 31.5]", "[60, 60, 47.5]"),
     "key 'intrinsics': expected a list of 4 numbers, found [60, 60, "},
    {"intrinsics in words", replaced(kCamYaml, "[60, 60,", "[60, sixty,"), "expected a finite number, found 'sixty'"},
    {"no focal length", replaced(kCamYaml, "[60, 60,", "[0, 60,"), "expected focal lengths above 0 px"},
    {"fish-eye camera model", replaced(kCamYaml, "pinhole", "omni"), "key 'camera_model': expected pinhole"},
    {"unknown lens", replaced(kCamYaml, "radial-tangential", "bubble"), "key 'distortion_model': expected radial-"},
    {"lens without a number", replaced(kCamYaml, "[0, 0, 0, 0]\n", "[0, 0, 0]\n"), "'distortion_coefficients'"},
    {"pose that is no rotation", replaced(kCamYaml, "[1, 0, 0, 0, 0, 1,", "[2, 0, 0, 0, 0, 1,"), "rigid transform"},
    {"mirrored pose", replaced(kCamYaml, "[1, 0, 0, 0, 0, 1,", "[-1, 0, 0, 0, 0, 1,"), "rigid transform"},
    {"principal point outside", replaced(kCamYaml, "47.5, 31.5", "47.5, -31.5"), "expected a principal point within"},
    {"millimetres", replaced(kRangeYaml, "origin_in_cam_m: [0, 0, 0]", "origin_in_cam_m: [40, 10, -50]"),
     "key 'origin_in_cam_m': expected a place on the vehicle"},
    {"half pixels", replaced(kCamYaml, "[96, 64]", "[96.5, 64]"), "key 'resolution': expected width and height"},
    {"camera too large", replaced(kCamYaml, "[96, 64]\nintrinsics: [60, 60,", "[800, 64]\nintrinsics: [600, 600,"),
     "800 x 64 is beyond 752 x 480"},
    {"negative noise", replaced(kImuYaml, "1.7e-4", "-1.7e-4"), "refused for imu.gyro_noise_density; expected from"},
    {"beam to the rear", replaced(kRangeYaml, "[0, 0, 1]", "[0, 0, -1]"), "key 'axis_in_cam': expected a beam that"},
    {"no ranges", [](const SmallRecording& r) { r.write(kRangeCsv, "#t,range\n"); }, "range0/data.csv: holds no range"},
    {"range finder that is a file",
     [](const SmallRecording& r) {
       fs::remove_all(r.path() / "mav0/range0");
       r.write("mav0/range0", "");
     },
     "range0/sensor.yaml: not found"},
    {"last row cut short",
     [](const SmallRecording& r) {
       fs::resize_file(r.path() / kImuCsv, fs::file_size(r.path() / kImuCsv) - 3);  // within its last number
     },
     "imu0/data.csv line 321: no line end"},
    {"beam of length 2", replaced(kRangeYaml, "[0, 0, 1]", "[0, 0, 2]"), "key 'axis_in_cam': expected a vector of"},
    {"a key twice", replaced(kCamYaml, "camera_model: pinhole", "camera_model: pinhole\ncamera_model: pinhole"),
     "cam0/sensor.yaml line 4: key 'camera_model': stands on line 3 already; expected once"},
    {"broken yaml", replaced(kCamYaml, "[96, 64]", "[96, 64"), "cam0/sensor.yaml: not readable as YAML"},
    {"image missing", removed("mav0/cam0/data"), "line 2: image"},
    {"no images", [](const SmallRecording& r) { r.write(kCamCsv, "#t,file\n"); }, "cam0/data.csv: holds no image"},
    {"no samples", [](const SmallRecording& r) { r.write(kImuCsv, "\n"); }, "imu0/data.csv: holds no sample"},
    {"image time twice", replaced(kCamCsv, SmallRecording::image_time(2), SmallRecording::image_time(1)),
     "cam0/data.csv line 4: time stamp"},
    {"IMU time in words", replaced(kImuCsv, std::to_string(SmallRecording::kStart_ns) + ",", "now,"),
     "imu0/data.csv line 22: column 1: expected a time stamp"},
    {"IMU column missing", replaced(kImuCsv, ",-9.80665\n", "\n"), "imu0/data.csv line 2: expected 7 columns"},
    {"IMU value in words", replaced(kImuCsv, "-9.80665", "down"), "column 7: expected a number, found 'down'"},
    {"negative range", replaced(kRangeCsv, ",3.5", ",-3.5"), "range0/data.csv line 2: column 2: expected a range"},
    {"truth not a rotation", replaced(kTruthCsv, ",0,1,0,0,0", ",0,0,0,0,0"),
     "line 2: columns 5 to 8: expected a unit"},
    {"truth not a number", replaced(kTruthCsv, ",1,2,3", ",nan,2,3"), "line 2: column 2: expected a finite number"},
    {"images too dense", replaced(kCamCsv, SmallRecording::image_time(2), "1000050000007"),
     "cam0/data.csv: too many rows within the 4 ms before"},
    {"IMU of another clock",
     [](const SmallRecording& r) { r.write(kImuCsv, "7000000000,0,0,0,0,0,-9.8\n7005000000,0,0,0,0,0,-9.8\n"); },
     "imu0/data.csv: from 7000000000 to 7005000000 ns; expected stamps of the same clock as the images"},
    {"range finder of another clock", [](const SmallRecording& r) { r.write(kRangeCsv, "7000000000,3.5\n"); },
     "range0/data.csv: from 7000000000 to 7000000000 ns; expected stamps of the same clock as the images"},
    {"image that is none", [](const SmallRecording& r) { r.write(SmallRecording::image_name(7), "no picture"); },
     "1000350000000.png: not readable as an image"},
    {"image cut short", [](const SmallRecording& r) { fs::resize_file(r.path() / SmallRecording::image_name(7), 40); },
     "1000350000000.png: not readable as an image"},
    {"image cut off half way",
     [](const SmallRecording& r) {
       const fs::path image = r.path() / SmallRecording::image_name(7);
       fs::resize_file(image, fs::file_size(image) / 2);
     },
     "1000350000000.png: not readable as an image"},
    {"image of 16 bits",
     [](const SmallRecording& r) {
       cv::imwrite((r.path() / SmallRecording::image_name(7)).string(), cv::Mat::zeros(64, 96, CV_16UC1));
     },
     "1000350000000.png: has more than 8 bits per pixel; expected 8"},
    {"image of another size",
     [](const SmallRecording& r) {
       cv::imwrite((r.path() / SmallRecording::image_name(7)).string(), cv::Mat::zeros(64, 95, CV_8UC1));
     },
     "1000350000000.png: is 95 x 64 px; expected the resolution of cam0/sensor.yaml, 96 x 64"},
};

TEST(BadInput, IsToldInOneMessageAndLeavesNothing) {
  for (const BadCase& c : kCases) {
    SCOPED_TRACE(c.name);
    const SmallRecording recording;
    c.spoil(recording);
    const TemporaryFolder results;
    const fs::path out = results.path() / "out";
    const fs::path record = results.path() / "log.lcm";
    const ReplayResult result =
        run_replay("--asl " + quoted(recording.path()) + " --out " + quoted(out) + " --record " + quoted(record));
    EXPECT_EQ(result.exit_code, 2) << result.error;
    EXPECT_NE(result.error.find(c.message), std::string::npos) << result.error;
    EXPECT_NE(result.error.find("plumb-replay: " + recording.path().string()), std::string::npos) << result.error;
    EXPECT_TRUE(result.out.empty()) << result.out;
    EXPECT_FALSE(fs::exists(record));
    EXPECT_TRUE(!fs::exists(out) || fs::is_empty(out));
  }
}

TEST(BadInput, AllowsWhatTheWorldDoes) {
  struct Case {
    const char* name;
    std::function<void(const SmallRecording&)> change;
    const char* told;  // part of the final table
  };
  const Case cases[] = {
      {"no range finder", removed("mav0/range0"), "ranges          none"},
      {"no truth", removed("mav0/state_groundtruth_estimate0"), "processed 30"},
      {"range not a number", replaced(kRangeCsv, ",3.5", ",nan"), "ranges          30,"},
      {"IMU not a number", replaced(kImuCsv, "-9.80665", "nan"), "processed 30"},
      {"byte order mark", [](const SmallRecording& r) { r.write(kImuCsv, "\xEF\xBB\xBF" + r.content(kImuCsv)); },
       "processed 30"},
      {"Windows line ends", replaced(kImuCsv, "\n", "\r\n"), "processed 30"},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(c.name);
    const SmallRecording recording;
    c.change(recording);
    const ReplayResult result = run_replay("--asl " + quoted(recording.path()));
    EXPECT_EQ(result.exit_code, 0) << result.error;
    EXPECT_NE(result.out.find(c.told), std::string::npos) << result.out;
  }
}

TEST(BadInput, WarnsOfWhatCanBeFlownButIsHardlyMeant) {
  struct Case {
    const char* name;
    std::function<void(const SmallRecording&)> change;
    const char* warning;
  };
  const auto cut_imu = [](const SmallRecording& r) {
    const std::string table = r.content(kImuCsv);
    r.write(kImuCsv, table.substr(0, table.find(SmallRecording::image_time(20))));
  };
  const auto late_imu = [](const SmallRecording& r) {
    const std::string table = r.content(kImuCsv);
    r.write(kImuCsv, table.substr(table.find(SmallRecording::image_time(4))));
  };
  const Case cases[] = {
      {"IMU that ends early", cut_imu, "; 10 of 30 images are outside and get no state"},
      {"IMU that starts late", late_imu, "; 4 of 30 images are outside and get no state"},
      {"misspelt key", [](const SmallRecording& r) { r.write(kImuYaml, r.content(kImuYaml) + "gravity_mps: 9.8\n"); },
       "imu0/sensor.yaml line 7: key 'gravity_mps' is not known and has no effect"},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(c.name);
    const SmallRecording recording;
    EXPECT_EQ(run_replay("--asl " + quoted(recording.path())).error.find("warning"), std::string::npos);
    c.change(recording);
    const ReplayResult result = run_replay("--asl " + quoted(recording.path()));
    EXPECT_EQ(result.exit_code, 0) << result.error;
    EXPECT_NE(result.error.find("plumb-replay: warning: " + recording.path().string()), std::string::npos)
        << result.error;
    EXPECT_NE(result.error.find(c.warning), std::string::npos) << result.error;
  }
}

TEST(BadInput, WarnsWhenNoRangeIsValid) {
  const SmallRecording recording;
  std::string millimetres = recording.content(kRangeCsv);
  for (std::size_t at = 0; (at = millimetres.find(",3.5", at)) != std::string::npos;)
    millimetres.replace(at, 4, ",3500");
  recording.write(kRangeCsv, millimetres);
  const ReplayResult result = run_replay("--asl " + quoted(recording.path()));
  EXPECT_EQ(result.exit_code, 0) << result.error;
  EXPECT_NE(result.error.find("warning: every range was invalid"), std::string::npos) << result.error;
}

TEST(BadInput, WarnsWhenTheFilterNeverStarts) {
  const SmallRecording recording;
  for (int i = 0; i < SmallRecording::kImages; ++i) {
    const cv::Mat black = cv::Mat::zeros(SmallRecording::kHeight, SmallRecording::kWidth, CV_8UC1);
    cv::imwrite((recording.path() / SmallRecording::image_name(i)).string(), black);
  }
  const ReplayResult result = run_replay("--asl " + quoted(recording.path()));
  EXPECT_EQ(result.exit_code, 0) << result.error;
  EXPECT_NE(result.error.find("warning: no image got a state"), std::string::npos) << result.error;
}

}  // namespace
}  // namespace plumb::test
