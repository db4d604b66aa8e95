#pragma once
// Publishes a replay over LCM as the flight would: NAV_STATE, NAV_OUTPUT, NAV_HEALTH, EVENTS, TIMING.

#include <memory>
#include <string>

#include "fsw/app/publisher.h"
#include "hal/linux/lcm_sink.h"
#include "tools/replay/flight.h"

namespace plumb::replay {

class LiveTelemetry final : public FlightListener {
 public:
  /// Throws InputError when LCM cannot use the URL.
  explicit LiveTelemetry(const std::string& url);

  void on_predicted(const PredictedState& state) override;
  void on_image(const ImageRecord& record) override;
  void on_event(const Event& event) override;
  void on_health(const HealthRecord& record) override;

  std::uint64_t sent() const { return publisher_.sent(); }
  std::uint64_t lost() const { return publisher_.lost(); }

 private:
  std::unique_ptr<LcmSink> sink_;
  Publisher publisher_;
};

}  // namespace plumb::replay
