#pragma once
// Flight records to LCM messages in the caller's buffer, and back. No heap: sizes are fixed, a buffer that is too small
// is kFull. Decoders take bytes from anywhere (a log, a network) and refuse with kInvalidValue whatever is not exactly
// a message of that type with counts, enums and flags in range. The types are in *.lcm.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "fsw/base/fixed_vector.h"
#include "fsw/base/stage_observer.h"
#include "fsw/base/status.h"
#include "fsw/estimator/options.h"
#include "fsw/estimator/report.h"
#include "fsw/measurement/input_frame.h"
#include "fsw/measurement/nav_state.h"
#include "fsw/modes/sensor_health.h"
#include "fsw/predictor/output_predictor.h"
#include "fsw/vision/camera_model.h"

namespace plumb {

namespace channel {
inline constexpr const char* kNavState = "NAV_STATE";
inline constexpr const char* kNavOutput = "NAV_OUTPUT";
inline constexpr const char* kNavHealth = "NAV_HEALTH";
inline constexpr const char* kTiming = "TIMING";
inline constexpr const char* kInputFrame = "INPUT_FRAME";
inline constexpr const char* kCamera = "CAMERA";
inline constexpr const char* kCalibration = "CALIBRATION";
inline constexpr const char* kParams = "PARAMS";
inline constexpr const char* kTruth = "TRUTH";
}  // namespace channel

/// Room for any message but an image.
inline constexpr std::size_t kMaxMessageBytes = 8192;
/// What an image message needs beside its pixels.
inline constexpr std::size_t kImageHeaderBytes = 8 + 8 + 4 * 4;

using MessageBuffer = std::span<std::uint8_t>;
using MessageBytes = std::span<const std::uint8_t>;

/// The estimate at an image with what was done to get it.
struct NavStateRecord {
  NavState state;
  NavStatus status;  ///< at the image
  FrameReport report;
  Time t_image;
  std::uint32_t sequence = 0;
  std::uint64_t state_hash = 0;
};

/// What the composition counts beside estimator and predictor.
struct NavSystemCounters {
  std::uint64_t ticks = 0;
  std::uint64_t ticks_out_of_order = 0;
  std::uint64_t samples_ahead = 0;   ///< IMU samples and ranges stamped after the tick that brought them: refused
  std::uint64_t frames = 0;          ///< camera frames offered
  std::uint64_t frames_skipped = 0;  ///< another frame was still waiting for the IMU
  std::uint64_t frames_refused = 0;  ///< no or too large pixels, stamped ahead, or refused by the tracker
  std::uint64_t commanded_resets = 0;
};

struct HealthRecord {
  Time t;
  EstimatorCounters estimator;
  NavSystemCounters system;
  PredictorCounters predictor;
  PredictorTracking tracking;
  CalibrationReport calibration;
  double pixel_noise_px = 0.0;  ///< in force, 1 sigma
  NavStatus status{};           ///< of the output
  std::array<SensorHealth, kSensorNames.size()> sensors{};
};

struct TimingRecord {
  Time t_image;
  std::uint32_t sequence = 0;
  std::array<std::int64_t, kStageCount> stage_ns{};
  std::int64_t step_ns = 0;
};

inline constexpr std::size_t kMaxParams = 128;
inline constexpr std::size_t kMaxParamName = 47;   ///< characters
inline constexpr std::size_t kMaxConfigName = 15;  ///< characters

struct ParamValue {
  std::array<char, kMaxParamName + 1> name{};  ///< zero-terminated
  double value = 0.0;
};

struct ParamsRecord {
  std::array<char, kMaxConfigName + 1> configuration{};  ///< zero-terminated
  FixedVector<ParamValue, kMaxParams> values;
};

/// Number of bytes written.
Result<std::size_t> encode(const NavStateRecord& record, MessageBuffer buffer);
Result<std::size_t> encode(const PredictedState& state, MessageBuffer buffer);
Result<std::size_t> encode(const HealthRecord& record, MessageBuffer buffer);
Result<std::size_t> encode(const TimingRecord& record, MessageBuffer buffer);
Result<std::size_t> encode(const InputFrame& frame, MessageBuffer buffer);
Result<std::size_t> encode(const CameraCalibration& camera, const SensorCalibration& sensor, MessageBuffer buffer);
Result<std::size_t> encode(const ParamsRecord& params, MessageBuffer buffer);
/// Truth: a state without covariance.
Result<std::size_t> encode_truth(const NavState& truth, MessageBuffer buffer);
/// kInvalidValue for an image without pixels.
Result<std::size_t> encode(const CameraFrame& frame, MessageBuffer buffer);

Status decode(MessageBytes message, NavStateRecord& record);
Status decode(MessageBytes message, InputFrame& frame);
Status decode(MessageBytes message, CameraCalibration& camera, SensorCalibration& sensor);
Status decode(MessageBytes message, ParamsRecord& params);
Status decode_truth(MessageBytes message, NavState& truth);
/// The image's pixels are those in `message`, which must outlive the frame.
Status decode(MessageBytes message, CameraFrame& frame);

}  // namespace plumb
