#include "tools/replay/log_reader.h"

#include <algorithm>
#include <deque>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "config/calibration_reader.h"
#include "config/flight_config.h"
#include "config/input_error.h"
#include "fsw/telemetry/executive_messages.h"
#include "fsw/telemetry/messages.h"
#include "hal/linux/lcm_log.h"
#include "plumb_lcm/plumb/config_t.hpp"
#include "tools/replay/raw_samples.h"

namespace plumb::replay {
namespace {

class LogSource final : public Source {
 public:
  explicit LogSource(const LogOptions& options) : file_(options.file), use_range_(options.use_range) {
    session_.source = file_.string();
    survey();
    if (!use_range_) session_.parameters.estimator.range.enabled = false;
    session_.inputs.push_back(file_);
    if (options.from_raw) raw_.emplace(configuration());
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
      if (raw_ && !raw_->take(event_.channel, event_.message))
        fail("channel " + event_.channel + ": not a valid message");
      if (event_.channel != channel::kInputFrame) continue;
      read_input(tick.input);
      if (raw_) {
        if (const std::string fault = raw_->replace_samples(tick.input); !fault.empty()) fail(fault);
      }
      if (!use_range_) tick.input.range.clear();
      tick.image = {};
      if (tick.input.has_camera && !tick.input.image_skipped) tick.image = image_of(tick.input);
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
    if (!ok(status)) fail("is damaged; expected a whole LCM event log");
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
      } else if (name == channel::kConfig) {
        config_.assign(event_.message.begin(), event_.message.end());
      } else if (name == channel::kLogGap) {
        ++gaps_;
      } else if (name == channel::kInputFrame) {
        if (!calibrated || !parameterised) fail("expected CALIBRATION and PARAMS before the first INPUT_FRAME");
        count_input();
      }
    }
    if (session_.images == 0)
      fail("holds no INPUT_FRAME with an image; expected a log written by plumb-fsw or plumb-replay --record");
    if (reader_->is_cut()) {
      session_.warnings.push_back(file_.string() + ": is cut short after byte " + std::to_string(reader_->position()) +
                                  ": its writer was killed or its disk full; flown up to there");
      // The states of images whose input frames were not written any more.
      std::erase_if(session_.recorded_hashes, [this](const auto& hash) { return !images_flown_.contains(hash.first); });
    }
    if (gaps_ > 0) {
      session_.warnings.push_back(file_.string() + ": has " + std::to_string(gaps_) +
                                  " gaps: the disk was too slow for the flight, and records are missing");
    }
  }

  FlightSetup configuration() const {
    config_t config;
    if (config_.empty() || config.decode(config_.data(), 0, static_cast<int>(config_.size())) < 0) {
      fail("--raw: channel CONFIG: not there, or not a config_t; expected a log written by plumb-fsw");
    }
    std::vector<std::string> faults;
    const std::string text(config.text.begin(), config.text.end());
    const FlightSetup setup = read_flight_config(file_.string() + " channel CONFIG", text, faults);
    if (!faults.empty()) throw InputError(faults.front());
    return setup;
  }

  void count_input() {
    InputFrame input;
    read_input(input);
    session_.imu_samples += input.imu.size();
    if (use_range_) session_.ranges += input.range.size();
    if (!input.has_camera) return;
    images_flown_.insert(input.camera.sequence);
    if (session_.images++ == 0) session_.t_first_image = input.camera.t_exposure_mid;
    session_.t_last_image = input.camera.t_exposure_mid;
  }

  void read_input(InputFrame& input) {
    if (!ok(decode(event_.message, input))) fail("channel INPUT_FRAME: not a valid input_frame_t");
    if (input.t <= t_last_tick_) {
      fail("channel INPUT_FRAME: tick at " + std::to_string(input.t.ns()) + " ns is not after the one before");
    }
    t_last_tick_ = input.t;
    for (const Command& command : input.commands) {
      if (command.is(CommandId::kSetParameter) && !is_of_this_table(command)) {
        fail("channel INPUT_FRAME: sets a parameter of another table; expected a log of this version's parameters");
      }
    }
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
    KeptImage& kept = images_.emplace_back();
    kept.message.assign(event_.message.begin(), event_.message.end());
    if (!ok(decode(kept.message, kept.frame))) fail("channel CAMERA: not a valid image_t");
    if (images_.size() > kKeptImages) images_.pop_front();
  }

  /// Frames refer to images in order: those before this one are of no use any more.
  ImageView image_of(const InputFrame& input) {
    const std::string name = "image " + std::to_string(input.camera.sequence);
    const auto kept = std::find_if(images_.begin(), images_.end(), [&input](const KeptImage& candidate) {
      return candidate.frame.sequence == input.camera.sequence;
    });
    if (kept == images_.end()) {
      fail("channel CAMERA: " + name + " is not before the INPUT_FRAME that refers to it");
    }
    const CameraCalibration& camera = session_.calibration.camera;
    images_.erase(images_.begin(), kept);
    const ImageView& image = images_.front().frame.image;
    if (image.width != camera.width || image.height != camera.height) {
      fail("channel CAMERA: " + name + " is " + std::to_string(image.width) + " x " + std::to_string(image.height) +
           " px; expected the resolution of CALIBRATION, " + std::to_string(camera.width) + " x " +
           std::to_string(camera.height));
    }
    return image;
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
  /// When the disk kept plumb-fsw's log waiting, all that its queue of images holds, 4 MiB, stands before the frames
  /// that refer to them: this is enough for images of 160 x 120 px and more.
  static constexpr std::size_t kKeptImages = 256;
  struct KeptImage {
    std::vector<std::uint8_t> message;
    CameraFrame frame;  ///< its pixels are in `message`
  };
  std::deque<KeptImage> images_;
  std::vector<std::uint8_t> config_;
  std::uint64_t gaps_ = 0;
  std::set<std::uint32_t> images_flown_;
  std::optional<RawSamples> raw_;
};

}  // namespace

std::unique_ptr<Source> open_log(const LogOptions& options) { return std::make_unique<LogSource>(options); }

}  // namespace plumb::replay
