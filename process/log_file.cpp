#include "process/log_file.h"

#include <array>
#include <filesystem>
#include <vector>

#include "fsw/base/mission_config.h"
#include "fsw/telemetry/executive_messages.h"
#include "plumb_lcm/plumb/config_t.hpp"

namespace plumb {

std::string free_name(const std::string& name) {
  namespace fs = std::filesystem;
  const fs::path path(name);
  constexpr int kMostFlights = 10'000;
  for (int number = 0; number < kMostFlights; ++number) {
    const fs::path candidate =
        number == 0
            ? path
            : path.parent_path() / (path.stem().string() + "-" + std::to_string(number) + path.extension().string());
    if (!fs::exists(candidate)) return candidate.string();
  }
  return name;
}

Status write_session(LcmLogWriter& log, const FlightSetup& setup, Time t) {
  config_t config;
  config.size = static_cast<std::int32_t>(setup.text.size());
  config.text.assign(setup.text.begin(), setup.text.end());
  std::vector<std::uint8_t> text(static_cast<std::size_t>(config.getEncodedSize()));
  config.encode(text.data(), 0, config.getEncodedSize());
  if (const Status status = log.write(channel::kConfig, t, text); !ok(status)) return status;
  std::array<std::uint8_t, kMaxMessageBytes> message{};
  const auto write = [&](const char* channel, const Result<std::size_t>& size) {
    return log.write(channel, t, MessageBytes(message.data(), size.value()));
  };
  const Status calibrated =
      write(channel::kCalibration, encode(setup.calibration.camera, setup.calibration.sensor, message));
  if (!ok(calibrated)) return calibrated;
  return write(channel::kParams, encode(params_record(setup.parameters, FlightConfig::kName), message));
}

}  // namespace plumb
