#include "tools/replay/live_telemetry.h"

#include "config/input_error.h"
#include "fsw/telemetry/executive_messages.h"

namespace plumb::replay {
namespace {

std::unique_ptr<LcmSink> open_sink(const std::string& url) {
  if (url.starts_with("file:")) throw InputError("--lcm: '" + url + "' is a file; expected a network (--record logs)");
  std::string error;
  std::unique_ptr<LcmSink> sink = LcmSink::open(url, error);
  if (sink == nullptr) throw InputError("--lcm: " + error);
  return sink;
}

}  // namespace

LiveTelemetry::LiveTelemetry(const std::string& url) : sink_(open_sink(url)), publisher_(*sink_) {}

void LiveTelemetry::on_predicted(const PredictedState& state) { publisher_.publish(state); }

void LiveTelemetry::on_image(const ImageRecord& record) {
  publisher_.publish(record.nav);
  publisher_.publish(timing_record(record));
}

void LiveTelemetry::on_event(const Event& event) { publisher_.publish(event); }

void LiveTelemetry::on_health(const HealthRecord& record) { publisher_.publish(record); }

}  // namespace plumb::replay
