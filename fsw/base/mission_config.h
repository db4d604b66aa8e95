#pragma once
// The shipped sets of compile-time sizes. Everything static in the flight software takes its capacity from one of
// these, given as a template argument; check_mission_config refuses nonsense when it is compiled.

#include <cstddef>

namespace plumb {

/// Which calibration states a configuration has room for. Parameters (calibration.*) decide which of them are
/// estimated.
struct CalibrationBlocks {
  bool imu_scale = false;     ///< scale factors of gyro and accelerometer: 6 states
  bool camera = false;        ///< time offset and mounting of the camera: 7 states
  bool range_finder = false;  ///< direction and origin of the range finder's beam: 5 states
};

/// The settings of the paper's experiments (section VI): M = 4 poses, N = 27 SLAM features.
struct PaperConfig {
  static constexpr const char* kName = "paper";
  static constexpr std::size_t kMaxPoses = 4;           ///< M, camera poses in the sliding window
  static constexpr std::size_t kMaxSlamFeatures = 27;   ///< N, features in the state
  static constexpr std::size_t kMaxTracks = 200;        ///< feature tracks followed at once
  static constexpr std::size_t kMaxMsckfPerFrame = 24;  ///< tracks used in one MSCKF update
  static constexpr std::size_t kMaxImageWidth = 752;    ///< px
  static constexpr std::size_t kMaxImageHeight = 480;   ///< px
  static constexpr CalibrationBlocks kCalibration{};
};

// A build may choose other sizes: cmake -D PLUMB_POSES=8 -D PLUMB_FEATURES=20. Its logs say so by another name.
#if defined(PLUMB_POSES) && defined(PLUMB_FEATURES)
#define PLUMB_AS_TEXT_(x) #x
#define PLUMB_AS_TEXT(x) PLUMB_AS_TEXT_(x)
#define PLUMB_FLIGHT_NAME "flight-" PLUMB_AS_TEXT(PLUMB_POSES) "x" PLUMB_AS_TEXT(PLUMB_FEATURES)
#else
#define PLUMB_POSES 12
#define PLUMB_FEATURES 30
#define PLUMB_FLIGHT_NAME "flight"
#endif

/// The flight settings, chosen by measured accuracy for the time spent.
struct FlightConfig {
  static constexpr const char* kName = PLUMB_FLIGHT_NAME;
  static constexpr std::size_t kMaxPoses = PLUMB_POSES;
  static constexpr std::size_t kMaxSlamFeatures = PLUMB_FEATURES;
  static constexpr std::size_t kMaxTracks = 200;
  static constexpr std::size_t kMaxMsckfPerFrame = 24;
  static constexpr std::size_t kMaxImageWidth = 752;
  static constexpr std::size_t kMaxImageHeight = 480;
  static constexpr CalibrationBlocks kCalibration{};
};

/// The flight settings with room for every calibration state: for flights that calibrate the sensors.
struct SelfCalibratingConfig : FlightConfig {
  static constexpr const char* kName = "calibrating";
  static constexpr CalibrationBlocks kCalibration{.imu_scale = true, .camera = true, .range_finder = true};
};

template <class Config>
constexpr bool check_mission_config() {
  static_assert(Config::kMaxPoses >= 3, "the sliding window needs at least 3 poses to triangulate and re-anchor");
  static_assert(Config::kMaxPoses <= 32, "a window over 32 poses exceeds the track history (kMaxTrackLength)");
  static_assert(Config::kMaxSlamFeatures >= 3, "a ranged facet needs at least 3 SLAM features");
  static_assert(Config::kMaxTracks >= Config::kMaxSlamFeatures, "every SLAM feature needs a track");
  static_assert(Config::kMaxMsckfPerFrame >= 1, "the MSCKF update needs room for one track");
  static_assert(Config::kMaxImageWidth >= 64 && Config::kMaxImageHeight >= 64, "images must be at least 64 x 64 px");
  return true;
}
static_assert(check_mission_config<PaperConfig>());
static_assert(check_mission_config<FlightConfig>());
static_assert(check_mission_config<SelfCalibratingConfig>());

}  // namespace plumb
