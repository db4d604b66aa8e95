#pragma once
// Flies from an LCM event log: CALIBRATION and PARAMS, then INPUT_FRAMEs with the CAMERA image each refers to before
// it. Other channels are passed over, but for TRUTH and the hashes of NAV_STATE. The whole log is read once at the
// start, so that a damaged one is told at once.

#include <filesystem>
#include <memory>

#include "tools/replay/session.h"

namespace plumb::replay {

struct LogOptions {
  std::filesystem::path file;
  std::filesystem::path parameters;  ///< explicit parameter file, empty for none; wins over those of the log
  bool use_range = true;
  bool from_raw = false;  ///< samples from the bytes of the devices, through the drivers, instead of the input frames'
};

/// Throws InputError naming the file, the channel and what was expected.
std::unique_ptr<Source> open_log(const LogOptions& options);

}  // namespace plumb::replay
