#include "tools/replay/log_reader.h"

#include <string>
#include <string_view>

#include "config/calibration_reader.h"
#include "config/input_error.h"
#include "fsw/telemetry/messages.h"
#include "hal/linux/lcm_log.h"

namespace plumb::replay {
namespace {

class LogSource final : public Source {
 public:
  explicit LogSource(const LogOptions& options) : file_(options.file), use_range_(options.use_range) {
    session_.source = file_.string();
    survey();
    if (!use_range_) session_.parameters.estimator.range.enabled = false;
    session_.inputs.push_back(file_);
    if (!options.parameters.empty()) {
      session_.inputs.push_back(options.parameters);
      read_parameters(options.parameters, session_.parameters);
    }
    rewind();
  }

  const Session& session() const override { return session_; }

  bool next(Tick& tick) override {
    while (next_event()) {
      if (event_.channel == channel::kCamera) keep_image();
      if (event_.channel != channel::kInputFrame) continue;
      read_input(tick.input);
      if (!use_range_) tick.input.range.clear();
      tick.image = {};
      if (tick.input.has_camera) tick.image = image_of(tick.input);
      return true;
    }
    return false;
  }

 private:
  void rewind() {
    std::string error;
    reader_ = LcmLogReader::open(file_.string(), error);
    if (reader_ == nullptr) throw InputError(error);
    t_last_tick_ = Time::never();
  }

  bool next_event() {
    const Status status = reader_->next(event_);
    if (status == Status::kNotReady) return false;
    if (!ok(status)) fail("is damaged or cut short; expected a whole LCM event log");
    return true;
  }

  // One pass over everything: what the session has to say, and whether the log can be flown at all.
  void survey() {
    rewind();
    bool calibrated = false;
    bool parameterised = false;
    while (next_event()) {
      const std::string_view name = event_.channel;
      if (name == channel::kCalibration) {
        calibrated = true;
        const Status status = decode(event_.message, session_.calibration.camera, session_.calibration.sensor);
        if (!ok(status)) fail("channel CALIBRATION: not a usable calibration_t");
      } else if (name == channel::kParams) {
        parameterised = true;
        read_params();
      } else if (name == channel::kTruth) {
        NavState truth;
        if (!ok(decode_truth(event_.message, truth))) fail("channel TRUTH: not a truth_t");
        session_.truth.push_back(truth);
      } else if (name == channel::kNavState) {
        read_hash();
      } else if (name == channel::kInputFrame) {
        if (!calibrated || !parameterised) fail("expected CALIBRATION and PARAMS before the first INPUT_FRAME");
        count_input();
      }
    }
    if (session_.images == 0)
      fail("holds no INPUT_FRAME with an image; expected a log written by plumb-replay --record");
  }

  void count_input() {
    InputFrame input;
    read_input(input);
    session_.imu_samples += input.imu.size();
    if (use_range_) session_.ranges += input.range.size();
    if (!input.has_camera) return;
    if (session_.images++ == 0) session_.t_first_image = input.camera.t_exposure_mid;
    session_.t_last_image = input.camera.t_exposure_mid;
  }

  void read_input(InputFrame& input) {
    if (!ok(decode(event_.message, input))) fail("channel INPUT_FRAME: not a valid input_frame_t");
    if (input.t <= t_last_tick_) {
      fail("channel INPUT_FRAME: tick at " + std::to_string(input.t.ns()) + " ns is not after the one before");
    }
    t_last_tick_ = input.t;
  }

  void read_params() {
    ParamsRecord record;
    if (!ok(decode(event_.message, record))) fail("channel PARAMS: not a params_t");
    session_.config_name = record.configuration.data();
    for (const ParamValue& value : record.values) {
      const auto [status, row] = parameter_table().set(session_.parameters, value.name.data(), value.value);
      if (ok(status)) continue;
      const std::string problem = row == nullptr ? "': no parameter has this name" : "': value out of range";
      fail("channel PARAMS: '" + std::string(value.name.data()) + problem);
    }
  }

  void read_hash() {
    NavStateRecord record;
    if (!ok(decode(event_.message, record))) fail("channel NAV_STATE: not a nav_state_t");
    session_.recorded_hashes[record.sequence] = record.state_hash;
  }

  void keep_image() {
    image_message_.assign(event_.message.begin(), event_.message.end());
    if (!ok(decode(image_message_, image_))) fail("channel CAMERA: not a valid image_t");
  }

  ImageView image_of(const InputFrame& input) const {
    const std::string name = "image " + std::to_string(input.camera.sequence);
    if (image_message_.empty() || image_.sequence != input.camera.sequence) {
      fail("channel CAMERA: " + name + " is not before the INPUT_FRAME that refers to it");
    }
    const CameraCalibration& camera = session_.calibration.camera;
    if (image_.image.width != camera.width || image_.image.height != camera.height) {
      fail("channel CAMERA: " + name + " is " + std::to_string(image_.image.width) + " x " +
           std::to_string(image_.image.height) + " px; expected the resolution of CALIBRATION, " +
           std::to_string(camera.width) + " x " + std::to_string(camera.height));
    }
    return image_.image;
  }

  [[noreturn]] void fail(const std::string& message) const {
    throw InputError(file_.string() + " after byte " + std::to_string(reader_->position()) + ": " + message);
  }

  std::filesystem::path file_;
  bool use_range_;
  Session session_;
  std::unique_ptr<LcmLogReader> reader_;
  LogEvent event_;
  Time t_last_tick_ = Time::never();
  std::vector<std::uint8_t> image_message_;
  CameraFrame image_;
};

}  // namespace

std::unique_ptr<Source> open_log(const LogOptions& options) { return std::make_unique<LogSource>(options); }

}  // namespace plumb::replay
