#pragma once
// Records a flight as an LCM event log that --log can fly again: calibration and parameters first, then every input
// before it is used, and the navigation states with their hashes.

#include <array>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "hal/linux/lcm_log.h"
#include "tools/replay/flight.h"
#include "tools/replay/pending_file.h"
#include "tools/replay/session.h"

namespace plumb::replay {

class Recorder final : public FlightListener {
 public:
  /// Throws InputError when the file cannot be written or is an input of the session.
  Recorder(const std::filesystem::path& file, const Session& session, const std::string& config_name);

  void on_input(const Tick& tick) override;
  void on_predicted(const PredictedState& state) override;
  void on_image(const ImageRecord& record) override;
  void on_event(const Event& event) override;
  void on_health(const HealthRecord& record) override;
  /// Gives the log its name. Throws std::runtime_error when not all of it could be written.
  void commit();

 private:
  template <class... Record>
  void write(const char* channel, Time t, const Record&... record);
  void write_bytes(const char* channel, Time t, MessageBytes message);

  std::filesystem::path file_;
  PendingFile pending_;
  std::unique_ptr<LcmLogWriter> log_;
  std::vector<std::uint8_t> image_message_;
  std::array<std::uint8_t, kMaxMessageBytes> message_{};
};

}  // namespace plumb::replay
