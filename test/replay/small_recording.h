#pragma once
// A small made-up recording in the ASL layout: a camera at rest before a textured wall, 1.5 s at 20 Hz, IMU at 200 Hz,
// range at 20 Hz. A test spoils one file of it and sees what the user is told.

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "test/support/temporary_folder.h"

namespace plumb::test {

class SmallRecording {
 public:
  static constexpr std::int64_t kStart_ns = 1'000'000'000'000;
  static constexpr int kImages = 30;
  static constexpr int kWidth = 96;   // px
  static constexpr int kHeight = 64;  // px

  SmallRecording() {
    folder_.write("mav0/cam0/sensor.yaml",
                  "T_BS:\n  data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\ncamera_model: pinhole\n"
                  "resolution: [96, 64]\nintrinsics: [60, 60, 47.5, 31.5]\ndistortion_model: radial-tangential\n"
                  "distortion_coefficients: [0, 0, 0, 0]\n");
    folder_.write("mav0/imu0/sensor.yaml",
                  "T_BS:\n  data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n"
                  "gyroscope_noise_density: 1.7e-4\ngyroscope_random_walk: 2e-5\n"
                  "accelerometer_noise_density: 2e-3\naccelerometer_random_walk: 3e-3\n");
    folder_.write("mav0/range0/sensor.yaml",
                  "noise_stddev_m: 0.05\nmax_range_m: 40\naxis_in_cam: [0, 0, 1]\norigin_in_cam_m: [0, 0, 0]\n");
    write_tables();
    write_images();
  }

  std::filesystem::path path() const { return folder_.path(); }
  std::filesystem::path write(const std::string& name, const std::string& content) const {
    return folder_.write(name, content);
  }
  std::string content(const std::string& name) const { return content_of(path() / name); }
  /// Replaces the first `from` in a file. False when it is not there.
  bool replace(const std::string& name, const std::string& from, const std::string& to) const {
    std::string text = content(name);
    const std::size_t at = text.find(from);
    if (at == std::string::npos) return false;
    write(name, text.replace(at, from.size(), to));
    return true;
  }
  static std::string image_time(int image) { return std::to_string(kStart_ns + 50'000'000LL * image); }
  static std::string image_name(int image) { return "mav0/cam0/data/" + image_time(image) + ".png"; }

 private:
  void write_tables() const {
    std::string cam = "#timestamp [ns],filename\r\n";
    std::string range = "#timestamp [ns],range [m]\n";
    std::string truth = "#timestamp,p,q,v\n";
    for (int i = 0; i < kImages; ++i) {
      cam += image_time(i) + "," + image_time(i) + ".png\r\n";
      range += image_time(i) + (i % 5 == 4 ? ",0\n" : ",3.5\n");
      truth += image_time(i) + ",1,2,3,0,1,0,0,0,0,0\n";
    }
    std::string imu = "#timestamp [ns],w,w,w,a,a,a\n";
    for (int i = -20; i < 5 * 2 * kImages; ++i) {
      const std::string wobble = i % 2 == 0 ? "0.001" : "-0.001";
      imu += std::to_string(kStart_ns + 5'000'000LL * i) + "," + wobble + ",0,0,0," + wobble + ",-9.80665\n";
    }
    write("mav0/cam0/data.csv", cam);
    write("mav0/range0/data.csv", range);
    write("mav0/imu0/data.csv", imu);
    write("mav0/state_groundtruth_estimate0/data.csv", truth);
  }

  void write_images() const {
    std::filesystem::create_directories(path() / "mav0/cam0/data");
    cv::Mat image(kHeight, kWidth, CV_8UC1);
    for (int i = 0; i < kImages; ++i) {
      for (int v = 0; v < kHeight; ++v) {
        for (int u = 0; u < kWidth; ++u) {
          const double texture = std::sin(0.9 * u) * std::cos(0.7 * v) + std::sin(0.31 * u + 0.43 * v);
          image.at<std::uint8_t>(v, u) = static_cast<std::uint8_t>(128 + 50 * texture);
        }
      }
      cv::imwrite((path() / image_name(i)).string(), image);
    }
  }

  TemporaryFolder folder_;
};

}  // namespace plumb::test
