#include "tools/replay/recorder.h"

#include "config/input_error.h"
#include "fsw/telemetry/executive_messages.h"

namespace plumb::replay {

Recorder::Recorder(const std::filesystem::path& file, const Session& session, const std::string& config_name)
    : file_(file), pending_(file, session.inputs) {
  std::string error;
  pending_.close();  // LCM opens files by name
  log_ = LcmLogWriter::open(pending_.temporary_name().string(), error);
  if (log_ == nullptr) throw InputError(error);
  const CameraCalibration& camera = session.calibration.camera;
  image_message_.resize(kImageHeaderBytes + static_cast<std::size_t>(camera.width) * camera.height);
  const Time t = session.t_first_image;
  write(channel::kCalibration, t, camera, session.calibration.sensor);
  write(channel::kParams, t, params_record(session.parameters, config_name));
  for (const NavState& truth : session.truth) {
    const Result<std::size_t> size = encode_truth(truth, message_);
    write_bytes(channel::kTruth, truth.t, {message_.data(), size.value()});
  }
}

void Recorder::on_input(const Tick& tick) {
  if (tick.input.has_camera && !tick.input.image_skipped) {
    const CameraReference& camera = tick.input.camera;
    const CameraFrame frame{.t_exposure_mid = camera.t_exposure_mid, .sequence = camera.sequence, .image = tick.image};
    const Result<std::size_t> size = encode(frame, image_message_);
    write_bytes(channel::kCamera, tick.input.t, {image_message_.data(), size.value()});
  }
  write(channel::kInputFrame, tick.input.t, tick.input);
}

void Recorder::on_predicted(const PredictedState& state) { write(channel::kNavOutput, state.t, state); }

void Recorder::on_image(const ImageRecord& record) {
  write(channel::kNavState, record.nav.t_image, record.nav);
  write(channel::kTiming, record.nav.t_image, timing_record(record));
}

void Recorder::on_event(const Event& event) { write(channel::kEvents, event.t, event); }

void Recorder::on_health(const HealthRecord& record) { write(channel::kNavHealth, record.t, record); }

void Recorder::commit() {
  if (!ok(log_->flush())) throw WriteError(file_);
  log_.reset();
  pending_.commit();
}

template <class... Record>
void Recorder::write(const char* channel, Time t, const Record&... record) {
  const Result<std::size_t> size = encode(record..., message_);
  write_bytes(channel, t, {message_.data(), size.value()});
}

void Recorder::write_bytes(const char* channel, Time t, MessageBytes message) {
  if (!ok(log_->write(channel, t, message))) throw WriteError(file_);
}

}  // namespace plumb::replay
